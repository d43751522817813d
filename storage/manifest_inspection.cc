// SPDX-License-Identifier: Apache-2.0
#include "storage/manifest_inspection.h"

#include <rocksdb/file_system.h>

#include "storage/log_names.h"
#include "storage/log_reader.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

struct Reading {
  uint64_t end_bytes = 0;              // of what can be read without a gap
  std::optional<LogPiece> unreadable;  // the first; its record is empty
  uint64_t edits_behind = 0;           // that can be read behind it
};

Result<Reading> Read(const std::string& file, rocksdb::FileSystem& file_system) {
  Reading reading;
  VEDUTA_RETURN_IF_ERROR(ReadManifest(file_system, file, [&](const LogPiece& piece) {
    if (!piece.readable) {
      if (!reading.unreadable) reading.unreadable = piece;
    } else if (reading.unreadable) {
      ++reading.edits_behind;
    } else {
      reading.end_bytes = piece.end_bytes;
    }
    return Status::Ok();
  }));
  return reading;
}

Status Damaged(const std::string& path, const std::string& what) {
  return Status::Corruption("the manifest of the database at " + path + " is damaged: " + what +
                            ". Nothing was changed: 'veduta repair " + path +
                            "' brings back what can be read");
}

}  // namespace

Status CheckManifest(const std::string& path, rocksdb::FileSystem& file_system,
                     const std::optional<AcknowledgedMark>& mark) {
  std::string name;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(rocksdb::ReadFileToString(&file_system, path + "/CURRENT", &name),
                  "read " + path + "/CURRENT"));
  if (name.ends_with('\n')) name.pop_back();
  const std::optional<uint64_t> number = ParseManifestName(name);
  if (!number) return Damaged(path, "its file CURRENT names no manifest");
  const ManifestPosition claimed = mark ? mark->manifest : ManifestPosition();
  if (*number < claimed.number) {
    return Damaged(path, "its file CURRENT names " + name + ", which is older than number " +
                             std::to_string(claimed.number) + ", the last that was used");
  }
  VEDUTA_ASSIGN_OR_RETURN(const Reading reading, Read(path + "/" + name, file_system));
  const bool is_cut = *number == claimed.number && reading.end_bytes < claimed.size_bytes;
  const std::optional<LogPiece>& unreadable = reading.unreadable;
  if (unreadable && (is_cut || !unreadable->may_be_unwritten)) {
    return Damaged(path, "its file " + name + " cannot be read from byte " +
                             std::to_string(unreadable->begin_bytes) + " to byte " +
                             std::to_string(unreadable->end_bytes) + "; " +
                             std::to_string(reading.edits_behind) +
                             " records behind that can still be read");
  }
  if (!is_cut) return Status::Ok();
  return Damaged(path, "its file " + name + " ends at byte " + std::to_string(reading.end_bytes) +
                           ", and had " + std::to_string(claimed.size_bytes) + " bytes");
}

}  // namespace veduta
