// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keeps other processes from writing to a database whose files are looked at or exchanged while
// the database itself is not open.

#include <memory>
#include <string>

#include "storage/base/status.h"

namespace rocksdb {
class FileLock;
class FileSystem;
}  // namespace rocksdb

namespace veduta {

// Holds the lock that every program takes that opens the database for writing. Not thread-safe.
class FolderLock final {
 public:
  // kBusy while a process has the database open for writing; kIoError. `file_system` is for tests;
  // null is the operating system's.
  static Result<FolderLock> Take(const std::string& path,
                                 std::shared_ptr<rocksdb::FileSystem> file_system);
  ~FolderLock();
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;

 private:
  FolderLock(std::shared_ptr<rocksdb::FileSystem> file_system, rocksdb::FileLock* lock);

  std::shared_ptr<rocksdb::FileSystem> file_system_;
  rocksdb::FileLock* lock_;
};

}  // namespace veduta
