// SPDX-License-Identifier: Apache-2.0
#include "storage/blob_keys.h"

#include <rocksdb/env.h>
#include <rocksdb/metadata.h>
#include <rocksdb/options.h>
#include <rocksdb/sst_file_reader.h>
#include <rocksdb/utilities/debug.h>

#include <memory>
#include <string>
#include <vector>

#include "storage/family_options.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// RocksDB's numbers of value types, which its files hold and which therefore stay.
constexpr int kTypeValue = 0x1;
constexpr int kTypeBlobIndex = 0x11;

constexpr size_t kVersionsPerPage = 32;  // some are whole photos

bool IsDeletion(int type) {
  return type != kTypeValue && type != kTypeBlobIndex;
}

// Reads up to `count` versions of keys from `begin` on, and says whether there are no others.
Result<bool> ReadPage(const DatabaseFiles& files, Family family, const std::string& begin,
                      size_t count, std::vector<rocksdb::KeyVersion>* versions) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  const std::string end(64, '\xFF');  // above every key of ours
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(
      rocksdb::GetAllKeyVersions(&files.db(), files.handle(family), begin, end, count, versions),
      std::string("list family ") + FamilyName(family)));
  return versions->size() < count;
}

// GetAllKeyVersions of RocksDB 7.8 passes over what it cannot read of a table, and says nothing. So
// the tables are read before, which in these families are small.
Status CheckTable(const rocksdb::Options& options, const std::string& path) {
  rocksdb::SstFileReader table(options);
  rocksdb::Status status = table.Open(path);
  if (status.ok()) status = table.VerifyChecksum();
  return FromRocksdb(status, "read table " + path);
}

Status CheckTables(const DatabaseFiles& files, Family family) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  const std::unique_ptr<rocksdb::Env> env = rocksdb::NewCompositeEnv(files.shared_file_system());
  // Opened as the database opens them, so that what fails there fails here.
  rocksdb::Options options(rocksdb::DBOptions(), FamilyOptions(family, nullptr));
  options.env = env.get();
  rocksdb::ColumnFamilyMetaData data;
  files.db().GetColumnFamilyMetaData(files.handle(family), &data);
  for (const rocksdb::LevelMetaData& level : data.levels) {
    for (const rocksdb::SstFileMetaData& table : level.files) {
      const std::string path = files.path() + "/" + table.relative_filename;
      const Status checked = CheckTable(options, path);
      if (checked.ok()) continue;
      // A compaction may have replaced it meanwhile.
      const auto found = files.file_system().FileExists(path, rocksdb::IOOptions(), nullptr);
      if (!found.IsNotFound()) return checked;
    }
  }
  return Status::Ok();
}

// The end of the run of versions of one key that begins at `first`, and whether the newest of them
// that is not newer than `newest` is a value.
size_t EndOfKey(const std::vector<rocksdb::KeyVersion>& versions, size_t first,
                rocksdb::SequenceNumber newest, bool* is_there) {
  *is_there = false;
  bool decided = false;
  size_t past = first;
  for (; past < versions.size() && versions[past].user_key == versions[first].user_key; ++past) {
    if (decided || versions[past].sequence > newest) continue;  // newest first
    decided = true;
    *is_there = !IsDeletion(versions[past].type);
  }
  return past;
}

}  // namespace

Status ScanBlobKeys(const DatabaseFiles& files, Family family, uint64_t newest,
                    const std::function<Result<bool>(std::string_view key)>& visit) {
  VEDUTA_RETURN_IF_ERROR(CheckTables(files, family));
  std::string begin;
  size_t page = kVersionsPerPage;
  for (;;) {
    std::vector<rocksdb::KeyVersion> versions;
    VEDUTA_ASSIGN_OR_RETURN(const bool last_page, ReadPage(files, family, begin, page, &versions));
    if (!last_page && versions.front().user_key == versions.back().user_key) {
      page *= 2;  // one key has more versions than a page holds
      continue;
    }
    for (size_t i = 0; i < versions.size();) {
      const std::string& key = versions[i].user_key;
      // The last key of a page that is not the last may have versions on the next one: it begins
      // that.
      if (!last_page && key == versions.back().user_key) break;
      bool is_there = false;
      i = EndOfKey(versions, i, newest, &is_there);
      if (!is_there) continue;
      VEDUTA_ASSIGN_OR_RETURN(const bool more, visit(key));
      if (!more) return Status::Ok();
    }
    if (last_page) return Status::Ok();
    begin = versions.back().user_key;
    page = kVersionsPerPage;
  }
}

}  // namespace veduta
