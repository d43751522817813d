// SPDX-License-Identifier: Apache-2.0
#include "tests/storage/fault_file_system.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>

namespace veduta {

std::filesystem::path FaultFileSystem::Disk::Normal(const std::string& path) {
  std::filesystem::path normal = std::filesystem::absolute(path).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

// Called with the mutex held, before every write operation.
rocksdb::IOStatus FaultFileSystem::Disk::Count() {
  if (power_out) return rocksdb::IOStatus::IOError("the power is out");
  ++write_count;
  if (failing_count == 0 || write_count < first_failing ||
      write_count - first_failing >= failing_count) {
    return rocksdb::IOStatus::OK();
  }
  ++fault_count;
  return fault == Fault::kNoSpace
             ? rocksdb::IOStatus::NoSpace("injected fault", "No space left on device")
             : rocksdb::IOStatus::IOError("injected fault");
}

void FaultFileSystem::Disk::Made(const std::string& path) {
  changes.push_back({Normal(path).string(), "", {}});
}

// Renames what is tracked under `from`, a file or a folder, along with it.
void FaultFileSystem::Disk::MoveTracked(const std::string& from, const std::string& to) {
  std::map<std::string, std::shared_ptr<FileLength>> moved;
  for (auto it = files.begin(); it != files.end();) {
    if (it->first == from || it->first.starts_with(from + "/")) {
      moved[to + it->first.substr(from.size())] = it->second;
      it = files.erase(it);
    } else {
      ++it;
    }
  }
  for (auto& [path, length] : moved) files[path] = length;
}

std::optional<std::string> FaultFileSystem::ReadAll(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  std::ifstream stream(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

class FaultFileSystem::File final : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  File(std::unique_ptr<rocksdb::FSWritableFile> target, std::shared_ptr<Disk> disk,
       std::shared_ptr<FileLength> length)
      : FSWritableFileOwnerWrapper(std::move(target)),
        disk_(std::move(disk)),
        length_(std::move(length)) {}

  rocksdb::IOStatus Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                           rocksdb::IODebugContext* debug) override {
    const std::lock_guard lock(disk_->mutex);
    const rocksdb::IOStatus fault = disk_->Count();
    const size_t size = fault.ok() ? data.size() : disk_->power_out ? 0 : data.size() / 2;
    const rocksdb::IOStatus written =
        target()->Append(rocksdb::Slice(data.data(), size), options, debug);
    if (written.ok()) length_->size += size;
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
    const std::lock_guard lock(disk_->mutex);
    const rocksdb::IOStatus fault = disk_->Count();
    if (!fault.ok()) return fault;
    const rocksdb::IOStatus cut = target()->Truncate(size, options, debug);
    if (cut.ok()) *length_ = {size, std::min(size, length_->synced)};
    return cut;
  }
  rocksdb::IOStatus Sync(const rocksdb::IOOptions& /*options*/,
                         rocksdb::IODebugContext* /*debug*/) override {
    const std::lock_guard lock(disk_->mutex);
    const rocksdb::IOStatus fault = disk_->Count();
    if (fault.ok()) length_->synced = length_->size;
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
  const std::shared_ptr<Disk> disk_;
  const std::shared_ptr<FileLength> length_;
};

class FaultFileSystem::Folder final : public rocksdb::FSDirectoryWrapper {
 public:
  Folder(std::unique_ptr<rocksdb::FSDirectory> target, std::shared_ptr<Disk> disk, std::string path)
      : FSDirectoryWrapper(std::move(target)), disk_(std::move(disk)), path_(std::move(path)) {}

  rocksdb::IOStatus Fsync(const rocksdb::IOOptions& /*options*/,
                          rocksdb::IODebugContext* /*debug*/) override {
    const std::lock_guard lock(disk_->mutex);
    const rocksdb::IOStatus fault = disk_->Count();
    if (fault.ok())
      std::erase_if(disk_->changes, [&](const Change& c) { return Disk::Folder(c.path) == path_; });
    return fault;
  }
  rocksdb::IOStatus FsyncWithDirOptions(const rocksdb::IOOptions& options,
                                        rocksdb::IODebugContext* debug,
                                        const rocksdb::DirFsyncOptions& /*directory*/) override {
    return Fsync(options, debug);
  }

 private:
  const std::shared_ptr<Disk> disk_;
  const std::string path_;
};

rocksdb::IOStatus FaultFileSystem::NewWritableFile(const std::string& name,
                                                   const rocksdb::FileOptions& options,
                                                   std::unique_ptr<rocksdb::FSWritableFile>* result,
                                                   rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex);
  const rocksdb::IOStatus fault = disk_->Count();
  if (!fault.ok()) return fault;
  const bool is_new = !std::filesystem::exists(name);
  std::unique_ptr<rocksdb::FSWritableFile> file;
  const rocksdb::IOStatus made = target()->NewWritableFile(name, options, &file, debug);
  if (!made.ok()) return made;
  if (is_new) disk_->Made(name);
  auto& length = disk_->files[Disk::Normal(name).string()] = std::make_shared<FileLength>();
  *result = std::make_unique<File>(std::move(file), disk_, length);
  return made;
}

rocksdb::IOStatus FaultFileSystem::ReopenWritableFile(
    const std::string& name, const rocksdb::FileOptions& options,
    std::unique_ptr<rocksdb::FSWritableFile>* result, rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex);
  const rocksdb::IOStatus fault = disk_->Count();
  if (!fault.ok()) return fault;
  const bool is_new = !std::filesystem::exists(name);
  const uint64_t size = is_new ? 0 : std::filesystem::file_size(name);
  std::unique_ptr<rocksdb::FSWritableFile> file;
  const rocksdb::IOStatus opened = target()->ReopenWritableFile(name, options, &file, debug);
  if (!opened.ok()) return opened;
  if (is_new) disk_->Made(name);
  auto& length = disk_->files[Disk::Normal(name).string()];
  if (!length) length = std::make_shared<FileLength>(FileLength{size, size});
  *result = std::make_unique<File>(std::move(file), disk_, length);
  return opened;
}

rocksdb::IOStatus FaultFileSystem::NewDirectory(const std::string& name,
                                                const rocksdb::IOOptions& options,
                                                std::unique_ptr<rocksdb::FSDirectory>* result,
                                                rocksdb::IODebugContext* debug) {
  std::unique_ptr<rocksdb::FSDirectory> folder;
  const rocksdb::IOStatus opened = target()->NewDirectory(name, options, &folder, debug);
  if (opened.ok())
    *result = std::make_unique<Folder>(std::move(folder), disk_, Disk::Normal(name).string());
  return opened;
}

rocksdb::IOStatus FaultFileSystem::DeleteFile(const std::string& name,
                                              const rocksdb::IOOptions& options,
                                              rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex);
  if (disk_->power_out) return rocksdb::IOStatus::IOError("the power is out");
  const rocksdb::IOStatus deleted = target()->DeleteFile(name, options, debug);
  if (deleted.ok()) {
    const std::string path = Disk::Normal(name).string();
    disk_->files.erase(path);
    std::erase_if(disk_->changes, [&](const Change& c) { return c.path == path; });
  }
  return deleted;
}

rocksdb::IOStatus FaultFileSystem::Truncate(const std::string& name, size_t size,
                                            const rocksdb::IOOptions& options,
                                            rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex);
  const rocksdb::IOStatus fault = disk_->Count();
  if (!fault.ok()) return fault;
  const rocksdb::IOStatus cut = target()->Truncate(name, size, options, debug);
  const auto tracked = disk_->files.find(Disk::Normal(name).string());
  if (cut.ok() && tracked != disk_->files.end()) {
    *tracked->second = {size, std::min<uint64_t>(size, tracked->second->synced)};
  }
  return cut;
}

rocksdb::IOStatus FaultFileSystem::CreateDir(const std::string& name,
                                             const rocksdb::IOOptions& options,
                                             rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex);
  const rocksdb::IOStatus fault = disk_->Count();
  if (!fault.ok()) return fault;
  const rocksdb::IOStatus made = target()->CreateDir(name, options, debug);
  if (made.ok()) disk_->Made(name);
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
  const std::lock_guard lock(disk_->mutex);
  const rocksdb::IOStatus fault = disk_->Count();
  if (!fault.ok()) return fault;
  std::optional<std::string> replaced = ReadAll(to);
  const std::string old_path = Disk::Normal(from).string(), new_path = Disk::Normal(to).string();
  const auto overwritten = disk_->files.find(new_path);
  // Of a file that was written over, a power cut brings back what was durable of it.
  if (replaced && overwritten != disk_->files.end())
    replaced->resize(std::min<size_t>(replaced->size(), overwritten->second->synced));
  const rocksdb::IOStatus renamed = target()->RenameFile(from, to, options, debug);
  if (!renamed.ok()) return renamed;
  disk_->files.erase(new_path);
  disk_->MoveTracked(old_path, new_path);
  disk_->changes.push_back({new_path, old_path, std::move(replaced)});
  return renamed;
}

rocksdb::IOStatus FaultFileSystem::LinkFile(const std::string& from, const std::string& to,
                                            const rocksdb::IOOptions& options,
                                            rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(disk_->mutex);
  const rocksdb::IOStatus fault = disk_->Count();
  if (!fault.ok()) return fault;
  const rocksdb::IOStatus linked = target()->LinkFile(from, to, options, debug);
  if (!linked.ok()) return linked;
  disk_->Made(to);
  const auto source = disk_->files.find(Disk::Normal(from).string());
  if (source != disk_->files.end()) disk_->files[Disk::Normal(to).string()] = source->second;
  return linked;
}

void FaultFileSystem::DropUnsyncedData() {
  const std::lock_guard lock(disk_->mutex);
  for (auto change = disk_->changes.rbegin(); change != disk_->changes.rend(); ++change) {
    std::error_code ignored;  // a folder above may be gone already, and the entry with it
    if (change->renamed_from.empty()) {
      std::filesystem::remove_all(change->path, ignored);
      std::erase_if(disk_->files, [&](const auto& file) {
        return file.first == change->path || file.first.starts_with(change->path + "/");
      });
      continue;
    }
    std::filesystem::rename(change->path, change->renamed_from, ignored);
    if (!ignored) disk_->MoveTracked(change->path, change->renamed_from);
    if (change->replaced) std::ofstream(change->path, std::ios::binary) << *change->replaced;
  }
  disk_->changes.clear();
  for (const auto& [path, length] : disk_->files) {
    if (std::filesystem::is_regular_file(path) &&
        std::filesystem::file_size(path) > length->synced) {
      std::filesystem::resize_file(path, length->synced);
    }
  }
  disk_->files.clear();
  disk_->power_out = false;
  disk_->failing_count = 0;
}

}  // namespace veduta
