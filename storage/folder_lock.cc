// SPDX-License-Identifier: Apache-2.0
#include "storage/folder_lock.h"

#include <rocksdb/file_system.h>

#include <utility>

#include "storage/rocksdb_status.h"

namespace veduta {

FolderLock::FolderLock(std::shared_ptr<rocksdb::FileSystem> file_system, rocksdb::FileLock* lock)
    : file_system_(std::move(file_system)), lock_(lock) {}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : file_system_(std::move(other.file_system_)), lock_(std::exchange(other.lock_, nullptr)) {}

FolderLock::~FolderLock() {
  if (lock_ == nullptr) return;
  // Where it cannot be given back, the operating system does so when the process ends.
  file_system_->UnlockFile(lock_, rocksdb::IOOptions(), nullptr).PermitUncheckedError();
}

Result<FolderLock> FolderLock::Take(const std::string& path,
                                    std::shared_ptr<rocksdb::FileSystem> file_system) {
  if (!file_system) file_system = rocksdb::FileSystem::Default();
  rocksdb::FileLock* lock = nullptr;
  const rocksdb::IOStatus taken =
      file_system->LockFile(path + "/LOCK", rocksdb::IOOptions(), &lock, nullptr);
  if (taken.ok()) return FolderLock(std::move(file_system), lock);
  const std::string words = taken.ToString();
  if (words.find("While lock file") != std::string::npos ||
      words.find("lock hold by current process") != std::string::npos) {
    return Status::Busy("the database at " + path +
                        " is in use by another veduta process; wait for it or stop it");
  }
  return FromRocksdb(taken, "lock the database at " + path);
}

}  // namespace veduta
