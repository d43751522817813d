// SPDX-License-Identifier: Apache-2.0
#include "storage/held_files.h"

#include <rocksdb/metadata.h>

#include <filesystem>
#include <utility>

#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// One open file that several users read from at once: reading names its place, so they do not
// disturb each other.
class SharedFile final : public rocksdb::FSRandomAccessFileWrapper {
 public:
  explicit SharedFile(std::shared_ptr<rocksdb::FSRandomAccessFile> file)
      : FSRandomAccessFileWrapper(file.get()), file_(std::move(file)) {}

 private:
  const std::shared_ptr<rocksdb::FSRandomAccessFile> file_;
};

std::string NameInFolder(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

}  // namespace

const HeldFiles::Held* HeldFiles::Find(const std::string& path) const {
  const std::lock_guard lock(mutex_);
  const auto found = held_.find(NameInFolder(path));
  return found == held_.end() ? nullptr : &found->second;
}

Status HeldFiles::HoldBlobFiles(rocksdb::DB& db, rocksdb::ColumnFamilyHandle* family) {
  rocksdb::ColumnFamilyMetaData data;
  db.GetColumnFamilyMetaData(family, &data);
  for (const rocksdb::BlobMetaData& blob : data.blob_files) {
    const std::string name = NameInFolder(blob.blob_file_name);
    const std::string path = db.GetName() + "/" + name;
    std::unique_ptr<rocksdb::FSRandomAccessFile> file;
    Held held;
    rocksdb::IOStatus status =
        target()->NewRandomAccessFile(path, rocksdb::FileOptions(), &file, nullptr);
    if (status.ok())
      status = target()->GetFileSize(path, rocksdb::IOOptions(), &held.size_bytes, nullptr);
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(status, "open the file " + path));
    held.file = std::move(file);
    const std::lock_guard lock(mutex_);
    held_.insert_or_assign(name, std::move(held));
  }
  return Status::Ok();
}

rocksdb::IOStatus HeldFiles::NewRandomAccessFile(
    const std::string& name, const rocksdb::FileOptions& options,
    std::unique_ptr<rocksdb::FSRandomAccessFile>* result, rocksdb::IODebugContext* debug) {
  const Held* held = Find(name);
  if (held == nullptr) return target()->NewRandomAccessFile(name, options, result, debug);
  *result = std::make_unique<SharedFile>(held->file);
  return rocksdb::IOStatus::OK();
}

rocksdb::IOStatus HeldFiles::GetFileSize(const std::string& name, const rocksdb::IOOptions& options,
                                         uint64_t* size_bytes, rocksdb::IODebugContext* debug) {
  const Held* held = Find(name);
  if (held == nullptr) return target()->GetFileSize(name, options, size_bytes, debug);
  *size_bytes = held->size_bytes;
  return rocksdb::IOStatus::OK();
}

}  // namespace veduta
