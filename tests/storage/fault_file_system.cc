// SPDX-License-Identifier: Apache-2.0
#include "tests/storage/fault_file_system.h"

#include <algorithm>
#include <filesystem>
#include <utility>

namespace veduta {

class FaultFileSystem::SequentialFile final : public rocksdb::FSSequentialFileOwnerWrapper {
 public:
  SequentialFile(std::unique_ptr<rocksdb::FSSequentialFile> target, std::shared_ptr<FaultDisk> disk)
      : FSSequentialFileOwnerWrapper(std::move(target)), disk_(std::move(disk)) {}

  rocksdb::IOStatus Read(size_t n, const rocksdb::IOOptions& options, rocksdb::Slice* result,
                         char* scratch, rocksdb::IODebugContext* debug) override {
    const rocksdb::IOStatus fault = BeginRead(*disk_);
    return fault.ok() ? target()->Read(n, options, result, scratch, debug) : fault;
  }

 private:
  const std::shared_ptr<FaultDisk> disk_;
};

class FaultFileSystem::RandomAccessFile final : public rocksdb::FSRandomAccessFileOwnerWrapper {
 public:
  RandomAccessFile(std::unique_ptr<rocksdb::FSRandomAccessFile> target,
                   std::shared_ptr<FaultDisk> disk)
      : FSRandomAccessFileOwnerWrapper(std::move(target)), disk_(std::move(disk)) {}

  rocksdb::IOStatus Read(uint64_t offset, size_t n, const rocksdb::IOOptions& options,
                         rocksdb::Slice* result, char* scratch,
                         rocksdb::IODebugContext* debug) const override {
    const rocksdb::IOStatus fault = BeginRead(*disk_);
    return fault.ok() ? target()->Read(offset, n, options, result, scratch, debug) : fault;
  }
  rocksdb::IOStatus MultiRead(rocksdb::FSReadRequest* requests, size_t count,
                              const rocksdb::IOOptions& options,
                              rocksdb::IODebugContext* debug) override {
    for (size_t i = 0; i < count; ++i) {
      rocksdb::FSReadRequest& r = requests[i];
      r.status = Read(r.offset, r.len, options, &r.result, r.scratch, debug);
    }
    return rocksdb::IOStatus::OK();
  }
  // RocksDB reads by itself what was not fetched before.
  rocksdb::IOStatus Prefetch(uint64_t, size_t, const rocksdb::IOOptions&,
                             rocksdb::IODebugContext*) override {
    return rocksdb::IOStatus::NotSupported("FaultFileSystem does not prefetch");
  }

 private:
  const std::shared_ptr<FaultDisk> disk_;
};

class FaultFileSystem::RandomRWFile final : public rocksdb::FSRandomRWFileOwnerWrapper {
 public:
  RandomRWFile(std::unique_ptr<rocksdb::FSRandomRWFile> target, std::shared_ptr<FaultDisk> disk,
               std::string path, std::shared_ptr<FaultDisk::Content> content)
      : FSRandomRWFileOwnerWrapper(std::move(target)),
        disk_(std::move(disk)),
        path_(std::move(path)),
        content_(std::move(content)) {}

  rocksdb::IOStatus Read(uint64_t offset, size_t n, const rocksdb::IOOptions& options,
                         rocksdb::Slice* result, char* scratch,
                         rocksdb::IODebugContext* debug) const override {
    const rocksdb::IOStatus fault = BeginRead(*disk_);
    return fault.ok() ? target()->Read(offset, n, options, result, scratch, debug) : fault;
  }
  rocksdb::IOStatus Write(uint64_t offset, const rocksdb::Slice& data,
                          const rocksdb::IOOptions& options,
                          rocksdb::IODebugContext* debug) override {
    const std::lock_guard lock(disk_->mutex());
    const rocksdb::IOStatus fault = disk_->Begin(Operation::kOverwrite);
    if (disk_->power_is_out()) return fault;
    const size_t size = fault.ok() ? data.size() : data.size() / 2;
    disk_->BeforeOverwrite(path_, content_.get(), offset, offset + size);
    const rocksdb::IOStatus written =
        target()->Write(offset, rocksdb::Slice(data.data(), size), options, debug);
    content_->size = std::max(content_->size, offset + size);
    return fault.ok() ? written : fault;
  }
  rocksdb::IOStatus Sync(const rocksdb::IOOptions& /*options*/,
                         rocksdb::IODebugContext* /*debug*/) override {
    const std::lock_guard lock(disk_->mutex());
    const rocksdb::IOStatus fault = disk_->Begin(Operation::kSync);
    if (!fault.ok()) return fault;
    content_->synced = content_->size;
    content_->pages_before.clear();
    return fault;
  }
  rocksdb::IOStatus Fsync(const rocksdb::IOOptions& options,
                          rocksdb::IODebugContext* debug) override {
    return Sync(options, debug);
  }

 private:
  const std::shared_ptr<FaultDisk> disk_;
  const std::string path_;
  const std::shared_ptr<FaultDisk::Content> content_;
};

class FaultFileSystem::File final : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  File(std::unique_ptr<rocksdb::FSWritableFile> target, std::shared_ptr<FaultDisk> disk,
       std::shared_ptr<FaultDisk::Content> content)
      : FSWritableFileOwnerWrapper(std::move(target)),
        disk_(std::move(disk)),
        content_(std::move(content)) {}

  rocksdb::IOStatus Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                           rocksdb::IODebugContext* debug) override {
    const std::lock_guard lock(disk_->mutex());
    const rocksdb::IOStatus fault = disk_->Begin(Operation::kWrite);
    const size_t size = fault.ok() ? data.size() : disk_->power_is_out() ? 0 : data.size() / 2;
    const rocksdb::IOStatus written =
        target()->Append(rocksdb::Slice(data.data(), size), options, debug);
    if (written.ok()) content_->size += size;
    return fault.ok() ? written : fault;
  }
  rocksdb::IOStatus Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                           const rocksdb::DataVerificationInfo& /*info*/,
                           rocksdb::IODebugContext* debug) override {
    return Append(data, options, debug);
  }
  rocksdb::IOStatus PositionedAppend(const rocksdb::Slice&, uint64_t, const rocksdb::IOOptions&,
                                     rocksdb::IODebugContext*) override {
    return rocksdb::IOStatus::NotSupported("FaultFileSystem has no direct writes");
  }
  rocksdb::IOStatus PositionedAppend(const rocksdb::Slice&, uint64_t, const rocksdb::IOOptions&,
                                     const rocksdb::DataVerificationInfo&,
                                     rocksdb::IODebugContext*) override {
    return rocksdb::IOStatus::NotSupported("FaultFileSystem has no direct writes");
  }
  rocksdb::IOStatus Truncate(uint64_t size, const rocksdb::IOOptions& options,
                             rocksdb::IODebugContext* debug) override {
    const std::lock_guard lock(disk_->mutex());
    const rocksdb::IOStatus fault = disk_->Begin(Operation::kWrite);
    if (!fault.ok()) return fault;
    const rocksdb::IOStatus cut = target()->Truncate(size, options, debug);
    if (cut.ok()) {
      content_->size = size;
      content_->synced = std::min(size, content_->synced);
    }
    return cut;
  }
  rocksdb::IOStatus Sync(const rocksdb::IOOptions& /*options*/,
                         rocksdb::IODebugContext* /*debug*/) override {
    const std::lock_guard lock(disk_->mutex());
    const rocksdb::IOStatus fault = disk_->Begin(Operation::kSync);
    if (fault.ok()) content_->synced = content_->size;
    return fault;
  }
  rocksdb::IOStatus Fsync(const rocksdb::IOOptions& options,
                          rocksdb::IODebugContext* debug) override {
    return Sync(options, debug);
  }
  // Space ahead of need: it costs more than everything else a test does.
  rocksdb::IOStatus Allocate(uint64_t, uint64_t, const rocksdb::IOOptions&,
                             rocksdb::IODebugContext*) override {
    return rocksdb::IOStatus::OK();
  }
  void PrepareWrite(size_t, size_t, const rocksdb::IOOptions&, rocksdb::IODebugContext*) override {}
  // Promises nothing about durability.
  rocksdb::IOStatus RangeSync(uint64_t, uint64_t, const rocksdb::IOOptions&,
                              rocksdb::IODebugContext*) override {
    return rocksdb::IOStatus::OK();
  }

 private:
  const std::shared_ptr<FaultDisk> disk_;
  const std::shared_ptr<FaultDisk::Content> content_;
};

class FaultFileSystem::Folder final : public rocksdb::FSDirectoryWrapper {
 public:
  Folder(std::unique_ptr<rocksdb::FSDirectory> target, std::shared_ptr<FaultDisk> disk,
         std::string path)
      : FSDirectoryWrapper(std::move(target)), disk_(std::move(disk)), path_(std::move(path)) {}

  rocksdb::IOStatus Fsync(const rocksdb::IOOptions& /*options*/,
                          rocksdb::IODebugContext* /*debug*/) override {
    const std::lock_guard lock(disk_->mutex());
    const rocksdb::IOStatus fault = disk_->Begin(Operation::kSync);
    if (fault.ok()) disk_->FolderSynced(path_);
    return fault;
  }
  rocksdb::IOStatus FsyncWithDirOptions(const rocksdb::IOOptions& options,
                                        rocksdb::IODebugContext* debug,
                                        const rocksdb::DirFsyncOptions& /*directory*/) override {
    return Fsync(options, debug);
  }

 private:
  const std::shared_ptr<FaultDisk> disk_;
  const std::string path_;
};

rocksdb::IOStatus FaultFileSystem::NewSequentialFile(
    const std::string& name, const rocksdb::FileOptions& options,
    std::unique_ptr<rocksdb::FSSequentialFile>* result, rocksdb::IODebugContext* debug) {
  const rocksdb::IOStatus fault = BeginRead(*disk_);
  if (!fault.ok()) return fault;
  std::unique_ptr<rocksdb::FSSequentialFile> file;
  const rocksdb::IOStatus opened = target()->NewSequentialFile(name, options, &file, debug);
  if (opened.ok()) *result = std::make_unique<SequentialFile>(std::move(file), disk_);
  return opened;
}

rocksdb::IOStatus FaultFileSystem::NewRandomAccessFile(
    const std::string& name, const rocksdb::FileOptions& options,
    std::unique_ptr<rocksdb::FSRandomAccessFile>* result, rocksdb::IODebugContext* debug) {
  const rocksdb::IOStatus fault = BeginRead(*disk_);
  if (!fault.ok()) return fault;
  std::unique_ptr<rocksdb::FSRandomAccessFile> file;
  const rocksdb::IOStatus opened = target()->NewRandomAccessFile(name, options, &file, debug);
  if (opened.ok()) *result = std::make_unique<RandomAccessFile>(std::move(file), disk_);
  return opened;
}

rocksdb::IOStatus FaultFileSystem::NewRandomRWFile(const std::string& name,
                                                   const rocksdb::FileOptions& options,
                                                   std::unique_ptr<rocksdb::FSRandomRWFile>* result,
                                                   rocksdb::IODebugContext* debug) {
  const rocksdb::IOStatus fault = BeginRead(*disk_);
  if (!fault.ok()) return fault;
  std::unique_ptr<rocksdb::FSRandomRWFile> file;
  const rocksdb::IOStatus opened = target()->NewRandomRWFile(name, options, &file, debug);
  if (!opened.ok()) return opened;
  const std::lock_guard lock(disk_->mutex());
  *result = std::make_unique<RandomRWFile>(std::move(file), disk_, name, disk_->Track(name));
  return opened;
}

rocksdb::IOStatus FaultFileSystem::GetChildren(const std::string& name,
                                               const rocksdb::IOOptions& options,
                                               std::vector<std::string>* result,
                                               rocksdb::IODebugContext* debug) {
  const rocksdb::IOStatus fault = BeginRead(*disk_);
  return fault.ok() ? target()->GetChildren(name, options, result, debug) : fault;
}

rocksdb::IOStatus FaultFileSystem::GetFileSize(const std::string& name,
                                               const rocksdb::IOOptions& options, uint64_t* size,
                                               rocksdb::IODebugContext* debug) {
  const rocksdb::IOStatus fault = BeginRead(*disk_);
  return fault.ok() ? target()->GetFileSize(name, options, size, debug) : fault;
}

rocksdb::IOStatus FaultFileSystem::NewWritableFile(const std::string& name,
                                                   const rocksdb::FileOptions& options,
                                                   std::unique_ptr<rocksdb::FSWritableFile>* result,
                                                   rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex());
  const rocksdb::IOStatus fault = disk_->Begin(Operation::kCreate);
  if (!fault.ok()) return fault;
  const bool is_new = !std::filesystem::exists(name);
  std::unique_ptr<rocksdb::FSWritableFile> file;
  const rocksdb::IOStatus made = target()->NewWritableFile(name, options, &file, debug);
  if (made.ok())
    *result = std::make_unique<File>(std::move(file), disk_, disk_->StartAnew(name, is_new));
  return made;
}

rocksdb::IOStatus FaultFileSystem::ReopenWritableFile(
    const std::string& name, const rocksdb::FileOptions& options,
    std::unique_ptr<rocksdb::FSWritableFile>* result, rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex());
  const rocksdb::IOStatus fault = disk_->Begin(Operation::kCreate);
  if (!fault.ok()) return fault;
  const bool is_new = !std::filesystem::exists(name);
  std::unique_ptr<rocksdb::FSWritableFile> file;
  const rocksdb::IOStatus opened = target()->ReopenWritableFile(name, options, &file, debug);
  if (!opened.ok()) return opened;
  auto content = is_new ? disk_->StartAnew(name, is_new) : disk_->Track(name);
  *result = std::make_unique<File>(std::move(file), disk_, std::move(content));
  return opened;
}

rocksdb::IOStatus FaultFileSystem::NewDirectory(const std::string& name,
                                                const rocksdb::IOOptions& options,
                                                std::unique_ptr<rocksdb::FSDirectory>* result,
                                                rocksdb::IODebugContext* debug) {
  std::unique_ptr<rocksdb::FSDirectory> folder;
  const rocksdb::IOStatus opened = target()->NewDirectory(name, options, &folder, debug);
  if (opened.ok())
    *result = std::make_unique<Folder>(std::move(folder), disk_, FaultDisk::Normal(name));
  return opened;
}

rocksdb::IOStatus FaultFileSystem::DeleteFile(const std::string& name,
                                              const rocksdb::IOOptions& options,
                                              rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex());
  const rocksdb::IOStatus fault = disk_->Begin(Operation::kDelete);
  if (!fault.ok()) return fault;
  if (!std::filesystem::is_regular_file(name)) return target()->DeleteFile(name, options, debug);
  disk_->BeforeDelete(name);
  const rocksdb::IOStatus deleted = target()->DeleteFile(name, options, debug);
  deleted.ok() ? disk_->Happened() : disk_->UndoLast();
  return deleted;
}

rocksdb::IOStatus FaultFileSystem::Truncate(const std::string& name, size_t size,
                                            const rocksdb::IOOptions& options,
                                            rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex());
  const rocksdb::IOStatus fault = disk_->Begin(Operation::kWrite);
  if (!fault.ok()) return fault;
  const auto content = disk_->Track(name);
  const rocksdb::IOStatus cut = target()->Truncate(name, size, options, debug);
  if (cut.ok()) {
    content->size = size;
    content->synced = std::min<uint64_t>(size, content->synced);
  }
  return cut;
}

rocksdb::IOStatus FaultFileSystem::CreateDir(const std::string& name,
                                             const rocksdb::IOOptions& options,
                                             rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex());
  const rocksdb::IOStatus fault = disk_->Begin(Operation::kCreate);
  if (!fault.ok()) return fault;
  const rocksdb::IOStatus made = target()->CreateDir(name, options, debug);
  if (made.ok()) disk_->FolderMade(name);
  return made;
}

rocksdb::IOStatus FaultFileSystem::CreateDirIfMissing(const std::string& name,
                                                      const rocksdb::IOOptions& options,
                                                      rocksdb::IODebugContext* debug) {
  if (std::filesystem::is_directory(name)) return rocksdb::IOStatus::OK();
  return CreateDir(name, options, debug);
}

rocksdb::IOStatus FaultFileSystem::RenameFile(const std::string& from, const std::string& to,
                                              const rocksdb::IOOptions& options,
                                              rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex());
  const rocksdb::IOStatus fault = disk_->Begin(Operation::kRename);
  if (!fault.ok()) return fault;
  if (!std::filesystem::exists(from)) return target()->RenameFile(from, to, options, debug);
  disk_->BeforeRename(from, to);
  const rocksdb::IOStatus renamed = target()->RenameFile(from, to, options, debug);
  renamed.ok() ? disk_->Happened() : disk_->UndoLast();
  return renamed;
}

rocksdb::IOStatus FaultFileSystem::LinkFile(const std::string& from, const std::string& to,
                                            const rocksdb::IOOptions& options,
                                            rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex());
  const rocksdb::IOStatus fault = disk_->Begin(Operation::kCreate);
  if (!fault.ok()) return fault;
  const rocksdb::IOStatus linked = target()->LinkFile(from, to, options, debug);
  if (linked.ok()) disk_->Linked(from, to);
  return linked;
}

}  // namespace veduta
