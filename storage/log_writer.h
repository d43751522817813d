// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes a file in the layout of RocksDB's write-ahead log (storage/log_format.h).

#include <rocksdb/file_system.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "storage/base/status.h"

namespace veduta {

// Not thread-safe. Once a function has failed, the file is of no use.
class LogWriter final {
 public:
  // Makes the file, or empties it. kIoError.
  static Result<LogWriter> Make(rocksdb::FileSystem& file_system, const std::string& path);

  Status Add(std::string_view record);
  Status Finish();  // makes what was added durable, and closes the file

 private:
  LogWriter() = default;
  Status Append(std::string_view bytes);

  std::string path_;
  std::unique_ptr<rocksdb::FSWritableFile> file_;
  size_t block_used_bytes_ = 0;
};

}  // namespace veduta
