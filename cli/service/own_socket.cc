// SPDX-License-Identifier: Apache-2.0
#include "cli/service/own_socket.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace veduta {
namespace {

// The address of the socket in this folder, by way of its file descriptor: paths of databases may
// be longer than addresses of sockets.
sockaddr_un AddressIn(int folder) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = "/proc/self/fd/" + std::to_string(folder) + "/" + kSocketName;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

int OpenFolder(const std::string& path) {
  return open(path.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
}

}  // namespace

Result<kj::AutoCloseFd> ListenAtSocket(const std::string& database) {
  const auto failed = [&] {
    return Status::IoError("cannot listen at " + database + "/" + kSocketName + ": " +
                           std::strerror(errno));
  };
  const int folder = OpenFolder(database);
  if (folder < 0) return failed();
  const kj::AutoCloseFd closing_folder(folder);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return failed();
  kj::AutoCloseFd closing(fd);
  const sockaddr_un address = AddressIn(folder);
  if (unlinkat(folder, kSocketName, 0) != 0 && errno != ENOENT) return failed();
  // Nobody is let in before the owner alone may come: connecting needs leave to write.
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      fchmodat(folder, kSocketName, S_IRUSR | S_IWUSR, 0) != 0 || listen(fd, SOMAXCONN) != 0)
    return failed();
  return closing;
}

void RemoveSocket(const std::string& database) {
  unlink((database + "/" + kSocketName).c_str());
}

std::optional<kj::AutoCloseFd> ConnectToSocket(const std::string& database) {
  const int folder = OpenFolder(database);
  if (folder < 0) return std::nullopt;
  const kj::AutoCloseFd closing_folder(folder);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return std::nullopt;
  kj::AutoCloseFd closing(fd);
  const sockaddr_un address = AddressIn(folder);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return std::nullopt;
  return closing;
}

}  // namespace veduta
