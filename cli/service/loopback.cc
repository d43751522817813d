// SPDX-License-Identifier: Apache-2.0
#include "cli/service/loopback.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>

namespace veduta {

std::string HostOf(const std::string& address) {
  const size_t colon = address.rfind(':');
  const size_t bracket = address.rfind(']');
  const bool has_port =
      colon != std::string::npos && (bracket == std::string::npos || colon > bracket);
  std::string host = has_port ? address.substr(0, colon) : address;
  std::ranges::transform(host, host.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return host;
}

bool IsThisMachine(const std::string& host) {
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

bool IsLoopbackWithPort(const std::string& address) {
  const std::string host = HostOf(address);
  return IsThisMachine(host) && host.size() < address.size();
}

Result<kj::AutoCloseFd> ListenAt(const std::string& address) {
  const std::string host = HostOf(address);
  const std::string port_text = address.size() > host.size() ? address.substr(host.size() + 1) : "";
  const auto failed = [&](const std::string& why) {
    return Status::IoError("cannot serve at " + address + ": " + why);
  };
  uint16_t port = 0;
  const char* const end = port_text.data() + port_text.size();
  const auto [rest, error] = std::from_chars(port_text.data(), end, port);
  if (error != std::errc() || rest != end) return failed("there is no port '" + port_text + "'");
  sockaddr_in6 six{};
  six.sin6_family = AF_INET6;
  six.sin6_port = htons(port);
  sockaddr_in four{};
  four.sin_family = AF_INET;
  four.sin_port = six.sin6_port;
  const bool is_six = host.starts_with('[') && host.ends_with(']');
  const std::string number = is_six                ? host.substr(1, host.size() - 2)
                             : host == "localhost" ? std::string("127.0.0.1")
                                                   : host;
  void* const into =
      is_six ? static_cast<void*>(&six.sin6_addr) : static_cast<void*>(&four.sin_addr);
  if (inet_pton(is_six ? AF_INET6 : AF_INET, number.c_str(), into) != 1) {
    return failed("'" + host +
                  "' is no address of this machine; 0.0.0.0 and [::] stand for all of them");
  }
  const int fd = socket(is_six ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return failed(std::strerror(errno));
  kj::AutoCloseFd closing(fd);
  const int yes = 1;  // an address that a daemon has just left may be taken at once
  const auto* const any =
      is_six ? reinterpret_cast<const sockaddr*>(&six) : reinterpret_cast<const sockaddr*>(&four);
  if (setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      bind(fd, any, is_six ? sizeof six : sizeof four) != 0 || listen(fd, SOMAXCONN) != 0)
    return failed(std::strerror(errno));
  return closing;
}

}  // namespace veduta
