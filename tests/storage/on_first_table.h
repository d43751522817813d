// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file system that tells of the first table that is opened in a folder.

#include <rocksdb/file_system.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace veduta {

// Does something when the first table is opened whose path contains `part`.
class OnFirstTable final : public rocksdb::FileSystemWrapper {
 public:
  OnFirstTable(std::string part, std::function<void()> act)
      : FileSystemWrapper(rocksdb::FileSystem::Default()),
        part_(std::move(part)),
        act_(std::move(act)) {}
  const char* Name() const override { return "OnFirstTable"; }
  rocksdb::IOStatus NewRandomAccessFile(const std::string& path,
                                        const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSRandomAccessFile>* file,
                                        rocksdb::IODebugContext* debug) override {
    if (path.find(part_) != std::string::npos) std::call_once(once_, act_);
    return target()->NewRandomAccessFile(path, options, file, debug);
  }

 private:
  const std::string part_;
  const std::function<void()> act_;
  std::once_flag once_;
};

}  // namespace veduta
