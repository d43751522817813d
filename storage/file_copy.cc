// SPDX-License-Identifier: Apache-2.0
#include "storage/file_copy.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <vector>

#include "storage/base/system_status.h"

namespace veduta {
namespace {

constexpr size_t kPieceBytes = 1 << 20;

Status LastError(const std::string& doing) {
  return FromSystem(std::error_code(errno, std::generic_category()), doing);
}

class OpenFile final {
 public:
  OpenFile(const std::string& path, int flags)
      : path_(path), file_(open(path.c_str(), flags | O_CLOEXEC, S_IRUSR | S_IWUSR)) {}
  ~OpenFile() {
    if (file_ >= 0) close(file_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  Status status() const { return file_ < 0 ? LastError("open " + path_) : Status::Ok(); }

  // How many bytes; 0 at the end.
  Result<size_t> Read(std::vector<char>* piece) const {
    for (;;) {
      const ssize_t count = read(file_, piece->data(), piece->size());
      if (count >= 0) return static_cast<size_t>(count);
      if (errno != EINTR) return LastError("read " + path_);
    }
  }

  Status Write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = write(file_, bytes.data(), bytes.size());
      if (count < 0 && errno != EINTR) return LastError("write " + path_);
      if (count > 0) bytes.remove_prefix(static_cast<size_t>(count));
    }
    return Status::Ok();
  }

  Status Sync() const { return fsync(file_) == 0 ? Status::Ok() : LastError("sync " + path_); }

 private:
  const std::string path_;
  const int file_;
};

}  // namespace

Status ReadPieces(const std::string& path, const std::stop_token& stop,
                  const std::function<Status(std::string_view piece)>& take) {
  const OpenFile file(path, O_RDONLY);
  VEDUTA_RETURN_IF_ERROR(file.status());
  std::vector<char> piece(kPieceBytes);
  for (;;) {
    if (stop.stop_requested()) return Status::Cancelled("stopped while " + path + " was read");
    VEDUTA_ASSIGN_OR_RETURN(const size_t count, file.Read(&piece));
    if (count == 0) return Status::Ok();
    VEDUTA_RETURN_IF_ERROR(take({piece.data(), count}));
  }
}

Result<ContentHash> HashFile(const std::string& path, const std::stop_token& stop) {
  ContentHasher hasher;
  VEDUTA_RETURN_IF_ERROR(ReadPieces(path, stop, [&](std::string_view piece) {
    hasher.Add(piece);
    return Status::Ok();
  }));
  return hasher.Finish();
}

Result<ContentHash> CopyFile(const std::string& from, const std::string& to,
                             const std::stop_token& stop) {
  const auto copy = [&]() -> Result<ContentHash> {
    const OpenFile target(to, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW);
    VEDUTA_RETURN_IF_ERROR(target.status());
    ContentHasher hasher;
    VEDUTA_RETURN_IF_ERROR(ReadPieces(from, stop, [&](std::string_view piece) {
      hasher.Add(piece);
      return target.Write(piece);
    }));
    VEDUTA_RETURN_IF_ERROR(target.Sync());
    return hasher.Finish();
  };
  Result<ContentHash> hash = copy();
  if (!hash.ok()) unlink(to.c_str());
  return hash;
}

Status WriteFileWhole(const std::string& path, std::string_view bytes) {
  const std::string temporary = path + ".new";
  const auto write = [&]() -> Status {
    const OpenFile file(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW);
    VEDUTA_RETURN_IF_ERROR(file.status());
    VEDUTA_RETURN_IF_ERROR(file.Write(bytes));
    VEDUTA_RETURN_IF_ERROR(file.Sync());
    if (rename(temporary.c_str(), path.c_str()) != 0) return LastError("write " + path);
    return SyncFolder(path.substr(0, path.find_last_of('/')));
  };
  const Status written = write();
  if (!written.ok()) unlink(temporary.c_str());
  return written;
}

Status SyncFolder(const std::string& folder) {
  const OpenFile opened(folder, O_RDONLY | O_DIRECTORY);
  VEDUTA_RETURN_IF_ERROR(opened.status());
  return opened.Sync();
}

}  // namespace veduta
