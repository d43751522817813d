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

// The address of a socket in this folder, by way of its file descriptor: paths of databases may be
// longer than addresses of sockets. Nothing where the name alone is too long.
std::optional<sockaddr_un> AddressIn(int folder, const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = "/proc/self/fd/" + std::to_string(folder) + "/" + name;
  if (path.size() >= sizeof address.sun_path) return std::nullopt;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

std::optional<kj::AutoCloseFd> ConnectIn(int folder, const std::string& name) {
  const auto address = AddressIn(folder, name);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return std::nullopt;
  kj::AutoCloseFd closing(fd);
  if (!address || connect(fd, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0)
    return std::nullopt;
  return closing;
}

int OpenFolder(const std::string& path) {
  return open(path.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
}

// Listens there; a socket of that name is replaced.
Result<kj::AutoCloseFd> ListenIn(int folder, const std::string& name, const std::string& told) {
  const auto failed = [&](const char* why) {
    return Status::IoError("cannot listen at " + told + ": " + why);
  };
  if (folder < 0) return failed(std::strerror(errno));
  const auto address = AddressIn(folder, name);
  if (!address) return failed("the name of a socket has at most 80 bytes");
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return failed(std::strerror(errno));
  kj::AutoCloseFd closing(fd);
  if (unlinkat(folder, name.c_str(), 0) != 0 && errno != ENOENT)
    return failed(std::strerror(errno));
  // Nobody is let in before the owner alone may come: connecting needs leave to write.
  if (bind(fd, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0 ||
      fchmodat(folder, name.c_str(), S_IRUSR | S_IWUSR, 0) != 0 || listen(fd, SOMAXCONN) != 0)
    return failed(std::strerror(errno));
  return closing;
}

}  // namespace

Result<kj::AutoCloseFd> ListenAtSocket(const std::string& database) {
  const kj::AutoCloseFd folder(OpenFolder(database));
  return ListenIn(folder.get(), kSocketName, database + "/" + kSocketName);
}

Result<kj::AutoCloseFd> ListenAtPath(const std::string& path) {
  const size_t slash = path.rfind('/');
  const std::string name = slash == std::string::npos ? path : path.substr(slash + 1);
  const std::string parent = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const kj::AutoCloseFd folder(OpenFolder(parent));
  struct stat there {};
  if (folder.get() >= 0 && fstatat(folder.get(), name.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0) {
    if (!S_ISSOCK(there.st_mode))
      return Status::IoError("cannot listen at " + path + ": something that is no socket is there");
    if (ConnectIn(folder.get(), name))
      return Status::IoError("cannot listen at " + path + ": another program does");
  }
  return ListenIn(folder.get(), name, path);
}

void RemoveSocket(const std::string& database) {
  unlink((database + "/" + kSocketName).c_str());
}

std::optional<kj::AutoCloseFd> ConnectToSocket(const std::string& database) {
  const kj::AutoCloseFd folder(OpenFolder(database));
  if (folder.get() < 0) return std::nullopt;
  return ConnectIn(folder.get(), kSocketName);
}

}  // namespace veduta
