// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/photo_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace veduta {
namespace {

Status CannotRead(const std::string& path, int error) {
  std::string message = "cannot read " + path + ": " + std::generic_category().message(error);
  if (error == ENOENT || error == ENOTDIR) return Status::NotFound(std::move(message));
  return Status::IoError(std::move(message));
}

class FileDescriptor final {
 public:
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() {
    if (number_ >= 0) close(number_);
  }
  int number() const { return number_; }

 private:
  const int number_;
};

}  // namespace

uint64_t PhotoFileSize(const std::string& path) {
  struct stat entry {};
  if (stat(path.c_str(), &entry) != 0 || !S_ISREG(entry.st_mode)) return 0;
  return static_cast<uint64_t>(entry.st_size);
}

Result<std::vector<uint8_t>> ReadPhotoFile(const std::string& path, uint64_t size_bytes_max) {
  // Opening a pipe would wait for somebody who writes to it.
  const FileDescriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) return CannotRead(path, errno);
  struct stat entry {};
  if (fstat(file.number(), &entry) != 0) return CannotRead(path, errno);
  if (!S_ISREG(entry.st_mode)) return Status::IoError("cannot read " + path + ": it is no file");
  const uint64_t wanted = std::min<uint64_t>(entry.st_size, size_bytes_max + 1);
  std::vector<uint8_t> bytes(wanted);
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = read(file.number(), bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return CannotRead(path, errno);
    if (count == 0) return Status::IoError("cannot read " + path + ": it became shorter meanwhile");
    done += static_cast<size_t>(count);
  }
  return bytes;
}

}  // namespace veduta
