// SPDX-License-Identifier: Apache-2.0
#include "cli/service/remote_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>

namespace veduta {
namespace {

std::string TextOf(const in6_addr& address) {
  char text[INET6_ADDRSTRLEN] = "";
  if (IN6_IS_ADDR_V4MAPPED(&address))
    return inet_ntop(AF_INET, &address.s6_addr[12], text, sizeof(text));
  return inet_ntop(AF_INET6, &address, text, sizeof(text));
}

// "192.0.2.1" of " 192.0.2.1:4711", "2001:db8::1" of "[2001:db8::1]:4711".
std::string WithoutPort(std::string text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_space(text.front())) text.erase(0, 1);
  while (!text.empty() && is_space(text.back())) text.pop_back();
  if (text.starts_with('[')) return text.substr(1, text.find(']') - 1);
  if (std::ranges::count(text, ':') == 1) return text.substr(0, text.find(':'));
  return text;
}

}  // namespace

std::optional<std::string> PlainAddress(const std::string& text) {
  in_addr four;
  if (inet_pton(AF_INET, text.c_str(), &four) == 1) {
    char plain[INET_ADDRSTRLEN] = "";
    return inet_ntop(AF_INET, &four, plain, sizeof(plain));
  }
  in6_addr six;
  if (inet_pton(AF_INET6, text.c_str(), &six) == 1) return TextOf(six);
  return std::nullopt;
}

std::string PeerOf(kj::AsyncIoStream& connection) {
  sockaddr_storage peer = {};
  kj::uint length = sizeof(peer);
  const auto failure = kj::runCatchingExceptions(
      [&] { connection.getpeername(reinterpret_cast<sockaddr*>(&peer), &length); });
  if (failure != nullptr) return "";
  char text[INET_ADDRSTRLEN] = "";
  if (peer.ss_family == AF_INET) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(peer);
    return inet_ntop(AF_INET, &four.sin_addr, text, sizeof(text));
  }
  if (peer.ss_family == AF_INET6)
    return TextOf(reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr);
  return "";
}

std::string SenderAddress(const std::string& peer, const std::string& forwarded_for,
                          const std::set<std::string>& proxies) {
  std::string address = peer;
  std::string rest = forwarded_for;
  while (!rest.empty() && proxies.contains(address)) {
    const size_t comma = rest.rfind(',');
    const bool is_first = comma == std::string::npos;
    const auto before = PlainAddress(WithoutPort(is_first ? rest : rest.substr(comma + 1)));
    if (!before) break;
    address = *before;
    rest.resize(is_first ? 0 : comma);
  }
  return address;
}

std::string SenderOf(const std::string& address) {
  in6_addr six;
  if (inet_pton(AF_INET6, address.c_str(), &six) != 1) return address;
  std::memset(&six.s6_addr[8], 0, 8);
  return TextOf(six) + "/64";
}

std::string CountedSender(const std::string& peer, const std::set<std::string>& proxies) {
  const bool is_anybody = peer == "127.0.0.1" || peer == "::1" || proxies.contains(peer);
  return is_anybody ? "" : SenderOf(peer);
}

}  // namespace veduta
