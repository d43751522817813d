// SPDX-License-Identifier: Apache-2.0
#pragma once
// The file ACKNOWLEDGED in the database's folder: up to where RocksDB's log and its manifest are
// known to be durable. It lies outside of both, so the loss of an end, or of a whole log, is
// noticed when the database is opened (storage/log_inspection.h, storage/manifest_inspection.h),
// before RocksDB forgets what it cannot read.
//
// It is written after each synced commit and synced only when the database closes: a process that
// is killed leaves the newest mark; a power cut may leave an older one, and then less of a loss
// is noticed. It never claims what was not synced.

#include <rocksdb/file_system.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "storage/base/status.h"

namespace veduta {

inline constexpr const char* kAcknowledgedFile = "ACKNOWLEDGED";

// RocksDB's list of its files.
struct ManifestPosition {
  uint64_t number = 0;      // of the file
  uint64_t size_bytes = 0;  // that were durable

  bool operator==(const ManifestPosition&) const = default;
};

struct AcknowledgedMark {
  uint64_t sequence = 0;  // all writes up to and with this number were durable
  // The last of them is in the log of this number, or in a later one; 0 where it is in no log,
  // because RocksDB has made tables of the logs before when the database was opened.
  uint64_t log = 0;
  uint64_t first_log = 0;  // the log that was begun when the database was last opened for writing
  ManifestPosition manifest;  // when the database was last opened for writing, or closed

  bool operator==(const AcknowledgedMark&) const = default;
};

// Nothing where the file is missing (an older program made the database, or it is a copy) or says
// nothing readable: then nothing is known. kIoError where it cannot be read.
Result<std::optional<AcknowledgedMark>> ReadAcknowledged(rocksdb::FileSystem& file_system,
                                                         const std::string& folder);

// Thread-safe.
class AcknowledgedFile final {
 public:
  // Opens the file, or makes one, and writes `mark` into it. kIoError.
  static Result<std::unique_ptr<AcknowledgedFile>> Open(
      std::shared_ptr<rocksdb::FileSystem> file_system, const std::string& folder,
      const AcknowledgedMark& mark);

  // Moves the mark on; one that claims no more than the last changes nothing. A failure to write is
  // not told: the file then claims less than it could, and what was acknowledged is durable anyway.
  void Advance(uint64_t sequence, uint64_t log);
  // Moves the mark to what is durable when the database closes, wherever in the log that lies (0:
  // it stays), and makes the mark durable, too.
  void Finish(uint64_t sequence, const ManifestPosition& manifest);

 private:
  AcknowledgedFile() = default;
  Status WriteSlot();

  std::mutex mutex_;
  AcknowledgedMark mark_;
  uint64_t turn_ = 0;  // of the newest slot; the slots are written in turns
  std::shared_ptr<rocksdb::FileSystem> file_system_;
  std::unique_ptr<rocksdb::FSRandomRWFile> file_;
};

}  // namespace veduta
