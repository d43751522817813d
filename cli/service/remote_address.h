// SPDX-License-Identifier: Apache-2.0
#pragma once
// The address that a request comes from, also where proxies stand between.

#include <kj/async-io.h>

#include <optional>
#include <set>
#include <string>

namespace veduta {

// An address of IP version 4 or 6 as everybody writes it ("192.0.2.1", "2001:db8::1"); one of
// version 4 within version 6 is that of version 4. Nothing for any other text.
std::optional<std::string> PlainAddress(const std::string& text);

// The address of the other end; empty where it is none of IP, or has gone.
std::string PeerOf(kj::AsyncIoStream& connection);

// Whose request it is: the peer's, or, where the peer is one of the `proxies` (PlainAddress), the
// one that these say in X-Forwarded-For. The header is read from its end, which the nearest proxy
// has written, and only as far as proxies are named: what stands before may be anybody's lie.
std::string SenderAddress(const std::string& peer, const std::string& forwarded_for,
                          const std::set<std::string>& proxies);

// What is counted as one sender: the address, or the first 64 bits of one of version 6, within
// which a sender takes whatever address it likes.
std::string SenderOf(const std::string& address);

// SenderOf the peer of a connection, whose connections are counted; empty for this machine and for
// proxies, by which anybody may come.
std::string CountedSender(const std::string& peer, const std::set<std::string>& proxies);

}  // namespace veduta
