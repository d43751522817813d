// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bytes that wait beside the file they will be part of, because what stands before them is not
// known yet.

#include <cstdint>
#include <fstream>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// Created empty, removed by the destructor. Not thread-safe. A failure to write shows at the latest
// in CopyTo.
class SpoolFile final {
 public:
  explicit SpoolFile(std::string path);
  ~SpoolFile();
  SpoolFile(const SpoolFile&) = delete;
  SpoolFile& operator=(const SpoolFile&) = delete;

  Status Append(const void* bytes, size_t size);
  // Appends everything to `out`. kIoError with the path.
  Status CopyTo(std::ofstream& out);
  uint64_t size_bytes() const { return size_bytes_; }

 private:
  std::string path_;
  std::ofstream file_;
  uint64_t size_bytes_ = 0;
};

// Opens PATH.new, lets `write` fill it, and renames it to PATH; removes it where anything failed.
// kIoError with the path.
template <typename Write>
Status WriteAndRename(const std::string& path, const Write& write);

Status RenameOver(const std::string& from, const std::string& to);
void RemoveQuietly(const std::string& path);

template <typename Write>
Status WriteAndRename(const std::string& path, const Write& write) {
  const std::string unfinished = path + ".new";
  std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
  Status status = out ? write(out) : Status::IoError("cannot write " + unfinished);
  out.close();
  if (status.ok() && !out) status = Status::IoError("cannot write " + unfinished);
  if (status.ok()) status = RenameOver(unfinished, path);
  if (!status.ok()) RemoveQuietly(unfinished);
  return status;
}

}  // namespace veduta
