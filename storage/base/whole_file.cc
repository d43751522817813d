// SPDX-License-Identifier: Apache-2.0
#include "storage/base/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace veduta {
namespace {

class OpenFile final {
 public:
  // O_NONBLOCK: opening a pipe that nobody writes to would wait otherwise.
  explicit OpenFile(const std::string& path)
      : number_(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)) {}
  ~OpenFile() {
    if (number_ >= 0) close(number_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int number() const { return number_; }

 private:
  const int number_;
};

// Empty for a regular file.
const char* WhatElse(mode_t mode) {
  if (S_ISREG(mode)) return "";
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

Status CannotRead(const std::string& path) {
  return Status::IoError("cannot read " + path + ": " + std::strerror(errno));
}

}  // namespace

Result<std::string> ReadWholeFile(const std::string& path, size_t size_bytes_max) {
  const OpenFile file(path);
  struct stat found = {};
  const bool is_open = file.number() >= 0;
  // A socket cannot be opened, but looked at.
  if ((is_open ? fstat(file.number(), &found) : stat(path.c_str(), &found)) != 0)
    return CannotRead(path);
  const std::string what = WhatElse(found.st_mode);
  if (!what.empty()) return Status::IoError(path + " is " + what + ", not a file");
  if (!is_open) return CannotRead(path);
  std::string text;
  // What the file system says may be short of what there is, as in /proc.
  size_t size = std::min(size_bytes_max, static_cast<size_t>(found.st_size));
  for (size_t done = 0;;) {
    text.resize(std::min(std::max(size, done + 4096), size_bytes_max) + 1);
    const ssize_t count = read(file.number(), text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return CannotRead(path);
    done += static_cast<size_t>(count);
    if (done > size_bytes_max) {
      return Status::InvalidArgument(path + " has more than " + std::to_string(size_bytes_max) +
                                     " bytes");
    }
    if (count > 0) {
      size = std::max(size, 2 * done);
      continue;
    }
    text.resize(done);
    return text;
  }
}

}  // namespace veduta
