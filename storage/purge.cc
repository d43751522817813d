// SPDX-License-Identifier: Apache-2.0
#include "storage/purge.h"

#include <rocksdb/file_system.h>
#include <rocksdb/metadata.h>

#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include "storage/log_salvage.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// How often snapshots of others are looked at. Chosen by hand; not measured.
constexpr std::chrono::milliseconds kSnapshotLook{20};

std::string Doing(Family family) {
  return std::string("rewrite family ") + FamilyName(family) + " without what was deleted";
}

// Whether a snapshot from before `sequence` is held: it keeps what was deleted since.
Result<bool> IsOlderSnapshotHeld(const DatabaseFiles& files, uint64_t sequence) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  uint64_t oldest = 0;  // 0: none
  if (!files.db().GetIntProperty(rocksdb::DB::Properties::kOldestSnapshotSequence, &oldest))
    return Status::IoError("RocksDB does not tell its oldest snapshot");
  return oldest != 0 && oldest < sequence;
}

Status WaitForSnapshots(const DatabaseFiles& files, std::chrono::milliseconds wait) {
  uint64_t sequence = 0;
  {
    const FilesLease lease(files);
    VEDUTA_RETURN_IF_ERROR(lease.status());
    sequence = files.db().GetLatestSequenceNumber();
  }
  const auto end = std::chrono::steady_clock::now() + wait;
  for (;;) {
    VEDUTA_ASSIGN_OR_RETURN(const bool held, IsOlderSnapshotHeld(files, sequence));
    if (!held) return Status::Ok();
    if (std::chrono::steady_clock::now() >= end) {
      return Status::Busy(
          "somebody still reads an earlier state of the database, so the bytes of removed photos "
          "stay in its files: remove once more when that has ended");
    }
    std::this_thread::sleep_for(kSnapshotLook);
  }
}

Status CompactTables(const DatabaseFiles& files, Family family,
                     const rocksdb::CompactRangeOptions& wanted) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  rocksdb::CompactRangeOptions options = wanted;
  options.bottommost_level_compaction = rocksdb::BottommostLevelCompaction::kForceOptimized;
  return FromRocksdb(files.db().CompactRange(options, files.handle(family), nullptr, nullptr),
                     Doing(family));
}

// The share of blob files, oldest first, that ends with the youngest in which something is deleted;
// 0 where there is none. Half a file more, for RocksDB cuts fractions of a file off.
Result<double> ShareWithGarbage(const DatabaseFiles& files, Family family) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  rocksdb::ColumnFamilyMetaData data;
  files.db().GetColumnFamilyMetaData(files.handle(family), &data);
  std::vector<rocksdb::BlobMetaData>& blobs = data.blob_files;
  std::sort(blobs.begin(), blobs.end(),
            [](const auto& a, const auto& b) { return a.blob_file_number < b.blob_file_number; });
  size_t last = 0;
  for (size_t i = 0; i < blobs.size(); ++i) {
    if (blobs[i].garbage_blob_count > 0) last = i + 1;
  }
  if (last == 0) return 0;
  return std::min(1.0, (static_cast<double>(last) + 0.5) / static_cast<double>(blobs.size()));
}

Status PurgeFamily(const DatabaseFiles& files, Family family) {
  rocksdb::CompactRangeOptions options;
  options.blob_garbage_collection_policy = rocksdb::BlobGarbageCollectionPolicy::kDisable;
  VEDUTA_RETURN_IF_ERROR(CompactTables(files, family, options));
  if (TraitsOf(family).store == ValueStore::kTable) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const double share, ShareWithGarbage(files, family));
  if (share == 0) return Status::Ok();
  options.blob_garbage_collection_policy = rocksdb::BlobGarbageCollectionPolicy::kForce;
  options.blob_garbage_collection_age_cutoff = share;
  return CompactTables(files, family, options);
}

Status FlushAll(const DatabaseFiles& files) {
  const FilesLease lease(files);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  for (const FamilyTraits& traits : AllFamilies()) {
    VEDUTA_RETURN_IF_ERROR(
        FromRocksdb(files.db().Flush(rocksdb::FlushOptions(), files.handle(traits.family)),
                    Doing(traits.family)));
  }
  return Status::Ok();
}

// Deletes a folder of folders of files; nothing where it is not there.
Status DeleteSetAside(const DatabaseFiles& files) {
  rocksdb::FileSystem& fs = files.file_system();
  const rocksdb::IOOptions io;
  const std::string top = files.path() + "/" + kSetAsideFolder;
  if (fs.FileExists(top, io, nullptr).IsNotFound()) return Status::Ok();
  const std::string doing = "delete the folder " + top;
  std::vector<std::string> folders, names;
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(fs.GetChildren(top, io, &folders, nullptr), doing));
  for (const std::string& folder : folders) {
    if (folder == "." || folder == "..") continue;
    const std::string path = top + "/" + folder;
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(fs.GetChildren(path, io, &names, nullptr), doing));
    for (const std::string& name : names) {
      if (name == "." || name == "..") continue;
      VEDUTA_RETURN_IF_ERROR(FromRocksdb(fs.DeleteFile(path + "/" + name, io, nullptr), doing));
    }
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(fs.DeleteDir(path, io, nullptr), doing));
  }
  return FromRocksdb(fs.DeleteDir(top, io, nullptr), doing);
}

}  // namespace

Status PurgeDeletedFrom(const DatabaseFiles& files, std::chrono::milliseconds wait) {
  if (files.read_only())
    return Status::InvalidArgument("a database that is open for reading only is not rewritten");
  VEDUTA_RETURN_IF_ERROR(WaitForSnapshots(files, wait));
  VEDUTA_RETURN_IF_ERROR(FlushAll(files));
  for (const FamilyTraits& traits : AllFamilies())
    VEDUTA_RETURN_IF_ERROR(PurgeFamily(files, traits.family));
  return DeleteSetAside(files);
}

}  // namespace veduta
