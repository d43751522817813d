// SPDX-License-Identifier: Apache-2.0
#include "storage/maintenance.h"

#include <rocksdb/file_system.h>
#include <rocksdb/metadata.h>
#include <rocksdb/statistics.h>
#include <rocksdb/utilities/checkpoint.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "storage/blob_keys.h"
#include "storage/database_opener.h"
#include "storage/records/key_bytes.h"
#include "storage/rocksdb_status.h"
#include "storage/value_reader.h"

namespace veduta {
namespace {

// Files and memory of one family.
uint64_t FamilyBytes(const DatabaseFiles& files, Family family) {
  rocksdb::ColumnFamilyMetaData data;
  files.db().GetColumnFamilyMetaData(files.handle(family), &data);
  uint64_t in_memory = 0;
  files.db().GetIntProperty(files.handle(family), rocksdb::DB::Properties::kCurSizeAllMemTables,
                            &in_memory);
  return data.size + data.blob_file_size + in_memory;
}

// 0 for a folder, and for a file that a compaction has deleted meanwhile.
uint64_t FileBytes(rocksdb::FileSystem& fs, const std::string& path) {
  bool is_folder = false;
  if (!fs.IsDirectory(path, rocksdb::IOOptions(), &is_folder, nullptr).ok() || is_folder) return 0;
  uint64_t size_bytes = 0;
  return fs.GetFileSize(path, rocksdb::IOOptions(), &size_bytes, nullptr).ok() ? size_bytes : 0;
}

Status Stopped() {
  return Status::Cancelled("stopped before all of the copy was read");
}

// Reads every value of a family by its checksums. A failure names family and key.
Status ReadFamily(const DatabaseFiles& files, Family family, const std::stop_token& stop) {
  const ValueReader reader(files, nullptr);
  if (TraitsOf(family).store == ValueStore::kTable) {
    std::string last;
    const Status read =
        reader.Scan(family, "", "", [&](std::string_view key, std::string_view, bool*) {
          last = key;
          return stop.stop_requested() ? Stopped() : Status::Ok();
        });
    const bool is_stopped = read.code() == StatusCode::kCancelled;
    if (read.ok() || is_stopped || last.empty()) return read;
    return Status(read.code(), std::string("family ") + FamilyName(family) + ", after key " +
                                   KeyText(last) + ": " + read.message());
  }
  // Key by key, for an iterator would not say which value it could not read.
  std::string value;
  return ScanBlobKeys(files, family, UINT64_MAX, [&](std::string_view key) -> Result<bool> {
    if (stop.stop_requested()) return Stopped();
    VEDUTA_RETURN_IF_ERROR(reader.Copy(family, key, &value).status());
    return true;
  });
}

// Reads all of a copy, as far as checksums guard it: tables with their indexes, and blobs.
Status CheckCopy(const std::string& path, std::shared_ptr<rocksdb::FileSystem> file_system,
                 const std::stop_token& stop) {
  DatabaseOptions options;
  options.read_only = options.salvage = true;  // nobody writes to it: no file need be held open
  options.file_system = std::move(file_system);
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<DatabaseFiles> copy,
                          DatabaseFiles::Open(path, options));
  for (const FamilyTraits& traits : AllFamilies())
    VEDUTA_RETURN_IF_ERROR(ReadFamily(*copy, traits.family, stop));
  if (stop.stop_requested()) return Stopped();  // RocksDB reads the tables without a pause
  const FilesLease lease(*copy);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  return FromRocksdb(copy->db().VerifyChecksum(), "read the copy at " + path);
}

}  // namespace

Result<DatabaseSizes> SizesOf(const DatabaseFiles& files) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  rocksdb::FileSystem& fs = files.file_system();
  std::vector<std::string> children;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(fs.GetChildren(files.path(), rocksdb::IOOptions(), &children, nullptr),
                  "list folder " + files.path()));
  DatabaseSizes sizes;
  for (const std::string& child : children)
    sizes.total_bytes += FileBytes(fs, files.path() + "/" + child);
  sizes.photo_bytes = FamilyBytes(files, Family::kPhotos);
  sizes.feature_bytes = FamilyBytes(files, Family::kFeatures);
  return sizes;
}

Result<DatabaseStatistics> StatisticsOf(const DatabaseFiles& files) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  const std::shared_ptr<rocksdb::Statistics> counters = files.db().GetDBOptions().statistics;
  if (counters == nullptr) return Status::NotFound("RocksDB counts nothing");
  DatabaseStatistics statistics;
  statistics.log_bytes = counters->getTickerCount(rocksdb::WAL_FILE_BYTES);
  statistics.flush_bytes = counters->getTickerCount(rocksdb::FLUSH_WRITE_BYTES);
  statistics.compaction_bytes = counters->getTickerCount(rocksdb::COMPACT_WRITE_BYTES);
  statistics.blob_bytes = counters->getTickerCount(rocksdb::BLOB_DB_BLOB_FILE_BYTES_WRITTEN);
  statistics.blob_copied_bytes = counters->getTickerCount(rocksdb::BLOB_DB_GC_BYTES_RELOCATED);
  statistics.cache_hits = counters->getTickerCount(rocksdb::BLOCK_CACHE_HIT);
  statistics.cache_misses = counters->getTickerCount(rocksdb::BLOCK_CACHE_MISS);
  return statistics;
}

namespace {

// As long as this runs, the files are not closed.
Status LinkFiles(const DatabaseFiles& files, const std::string& path) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  rocksdb::Checkpoint* raw = nullptr;
  const std::string doing = "make a checkpoint at " + path;
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(rocksdb::Checkpoint::Create(&files.db(), &raw), doing));
  const std::unique_ptr<rocksdb::Checkpoint> checkpoint(raw);
  return FromRocksdb(checkpoint->CreateCheckpoint(path), doing);
}

}  // namespace

Status MakeCheckpoint(const DatabaseFiles& files, const std::string& path) {
  if (files.read_only())
    return Status::InvalidArgument("a database that is open for reading only makes no checkpoint");
  rocksdb::FileSystem& fs = files.file_system();
  if (fs.FileExists(path, rocksdb::IOOptions(), nullptr).ok())
    return Status::AlreadyExists(path + " exists already");
  VEDUTA_RETURN_IF_ERROR(LinkFiles(files, path));
  return WriteMarker(fs, path);
}

Status CheckCheckpoint(const DatabaseFiles& files, const std::string& path,
                       const std::stop_token& stop) {
  const Status checked = CheckCopy(path, files.shared_file_system(), stop);
  if (checked.ok()) return checked;
  std::error_code ignored;  // what is left says that it is incomplete by the failure
  std::filesystem::remove_all(path, ignored);
  if (checked.code() == StatusCode::kCancelled)
    return Status::Cancelled("the copy was deleted: " + checked.message());
  return Status(checked.code(),
                "the copy was deleted, for it cannot be read: " + checked.message() +
                    ": 'veduta repair " + files.path() + "' says what is damaged");
}

Status CompactFiles(const DatabaseFiles& files) {
  if (files.read_only())
    return Status::InvalidArgument("a database that is open for reading only is not compacted");
  rocksdb::CompactRangeOptions options;
  options.bottommost_level_compaction = rocksdb::BottommostLevelCompaction::kForceOptimized;
  for (size_t i = 0; i < kFamilyCount; ++i) {
    const FilesLease lease(files);
    VEDUTA_RETURN_IF_ERROR(lease.status());
    const Family family = static_cast<Family>(i);
    const std::string doing = std::string("compact family ") + FamilyName(family);
    VEDUTA_RETURN_IF_ERROR(
        FromRocksdb(files.db().Flush(rocksdb::FlushOptions(), files.handle(family)), doing));
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(
        files.db().CompactRange(options, files.handle(family), nullptr, nullptr), doing));
  }
  return Status::Ok();
}

}  // namespace veduta
