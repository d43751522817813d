// SPDX-License-Identifier: Apache-2.0
#include "storage/database.h"

#include <rocksdb/file_system.h>
#include <rocksdb/metadata.h>
#include <rocksdb/utilities/checkpoint.h>

#include <string>
#include <utility>

#include "storage/database_files.h"
#include "storage/database_opener.h"
#include "storage/rocksdb_status.h"
#include "storage/snapshot_view.h"
#include "storage/write_ahead.h"
#include "storage/write_transaction.h"

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

class DatabaseView final : public Database {
 public:
  explicit DatabaseView(std::shared_ptr<DatabaseFiles> files) : files_(std::move(files)) {}

  std::shared_ptr<const Snapshot> GetSnapshot() const override { return MakeSnapshot(files_); }
  std::unique_ptr<Transaction> BeginTransaction() override {
    return MakeTransaction(files_, claims_);
  }

  Status WritePhotoAhead(const ContentHash& photo, std::span<const uint8_t> bytes,
                         const Features& features) override {
    return veduta::WritePhotoAhead(*files_, *claims_, photo, bytes, features);
  }
  Status DropPhotoAhead(const ContentHash& photo) override {
    return veduta::DropPhotoAhead(*files_, *claims_, photo);
  }
  Status WritePointBlocksAhead(ReconstructionId reconstruction, uint32_t generation,
                               std::span<const PointBlock> blocks) override {
    return veduta::WritePointBlocksAhead(*files_, reconstruction, generation, blocks);
  }
  Status WriteVocabularyAhead(uint32_t generation, std::span<const uint8_t> tree) override {
    return veduta::WriteVocabularyAhead(*files_, generation, tree);
  }
  Status WriteWordsAhead(uint32_t generation, ImageId image,
                         std::span<const WordId> words) override {
    return veduta::WriteWordsAhead(*files_, generation, image, words);
  }
  Status WritePostingsAhead(uint32_t generation, WordId word,
                            std::span<const ImageId> images) override {
    return veduta::WritePostingsAhead(*files_, generation, word, images);
  }

  Result<DatabaseSizes> GetSizes() const override {
    rocksdb::FileSystem& fs = files_->file_system();
    std::vector<std::string> children;
    VEDUTA_RETURN_IF_ERROR(
        FromRocksdb(fs.GetChildren(files_->path(), rocksdb::IOOptions(), &children, nullptr),
                    "list folder " + files_->path()));
    DatabaseSizes sizes;
    for (const std::string& child : children) {
      // A file that a compaction has deleted meanwhile, or a folder, counts nothing.
      uint64_t size_bytes = 0;
      const std::string path = files_->path() + "/" + child;
      bool is_folder = child == "." || child == "..";
      if (is_folder || !fs.IsDirectory(path, rocksdb::IOOptions(), &is_folder, nullptr).ok() ||
          is_folder)
        continue;
      if (fs.GetFileSize(path, rocksdb::IOOptions(), &size_bytes, nullptr).ok())
        sizes.total_bytes += size_bytes;
    }
    sizes.photo_bytes = FamilyBytes(*files_, Family::kPhotos);
    sizes.feature_bytes = FamilyBytes(*files_, Family::kFeatures);
    return sizes;
  }

  Status CreateCheckpoint(const std::string& path) override {
    if (files_->read_only())
      return Status::InvalidArgument(
          "a database that is open for reading only makes no checkpoint");
    rocksdb::FileSystem& fs = files_->file_system();
    if (fs.FileExists(path, rocksdb::IOOptions(), nullptr).ok())
      return Status::AlreadyExists(path + " exists already");
    rocksdb::Checkpoint* raw = nullptr;
    const std::string doing = "make a checkpoint at " + path;
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(rocksdb::Checkpoint::Create(&files_->db(), &raw), doing));
    const std::unique_ptr<rocksdb::Checkpoint> checkpoint(raw);
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(checkpoint->CreateCheckpoint(path), doing));
    return WriteMarker(fs, path);  // last: a folder without it is not taken for a database
  }

  Status Compact() override {
    if (files_->read_only())
      return Status::InvalidArgument("a database that is open for reading only is not compacted");
    rocksdb::CompactRangeOptions options;
    options.bottommost_level_compaction = rocksdb::BottommostLevelCompaction::kForceOptimized;
    for (size_t i = 0; i < kFamilyCount; ++i) {
      const Family family = static_cast<Family>(i);
      const std::string doing = std::string("compact family ") + FamilyName(family);
      VEDUTA_RETURN_IF_ERROR(
          FromRocksdb(files_->db().Flush(rocksdb::FlushOptions(), files_->handle(family)), doing));
      VEDUTA_RETURN_IF_ERROR(FromRocksdb(
          files_->db().CompactRange(options, files_->handle(family), nullptr, nullptr), doing));
    }
    return Status::Ok();
  }

 private:
  const std::shared_ptr<DatabaseFiles> files_;
  const std::shared_ptr<PhotoClaims> claims_ = std::make_shared<PhotoClaims>();
};

}  // namespace

Result<std::unique_ptr<Database>> Database::Open(const std::string& path,
                                                 const DatabaseOptions& options) {
  VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<DatabaseFiles> files, DatabaseFiles::Open(path, options));
  if (!options.read_only) VEDUTA_RETURN_IF_ERROR(SweepWriteAheads(*files));
  return std::unique_ptr<Database>(std::make_unique<DatabaseView>(std::move(files)));
}

}  // namespace veduta
