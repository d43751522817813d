// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/spool_file.h"

#include <filesystem>
#include <utility>
#include <vector>

namespace veduta {
namespace {

constexpr size_t kCopyBytes = 1u << 20;

}  // namespace

SpoolFile::SpoolFile(std::string path)
    : path_(std::move(path)), file_(path_, std::ios::binary | std::ios::trunc) {}

SpoolFile::~SpoolFile() {
  file_.close();
  RemoveQuietly(path_);
}

Status SpoolFile::Append(const void* bytes, size_t size) {
  if (!file_.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size))) {
    return Status::IoError("cannot write " + path_);
  }
  size_bytes_ += size;
  return {};
}

Status SpoolFile::CopyTo(std::ofstream& out) {
  if (!file_.flush()) return Status::IoError("cannot write " + path_);
  std::ifstream in(path_, std::ios::binary);
  std::vector<char> buffer(kCopyBytes);
  for (uint64_t left = size_bytes_; left > 0;) {
    const auto size = static_cast<std::streamsize>(std::min<uint64_t>(left, kCopyBytes));
    if (!in.read(buffer.data(), size)) return Status::IoError("cannot read " + path_);
    if (!out.write(buffer.data(), size))
      return Status::IoError("cannot write what " + path_ + " holds: disk full?");
    left -= static_cast<uint64_t>(size);
  }
  return {};
}

Status RenameOver(const std::string& from, const std::string& to) {
  std::error_code error;
  std::filesystem::rename(from, to, error);
  if (error) return Status::IoError("cannot rename " + from + " to " + to + ": " + error.message());
  return {};
}

void RemoveQuietly(const std::string& path) {
  std::error_code error;
  std::filesystem::remove(path, error);
}

}  // namespace veduta
