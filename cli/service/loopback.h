// SPDX-License-Identifier: Apache-2.0
#pragma once
// Addresses to listen at, and those by which this machine alone is reached.

#include <kj/io.h>

#include <string>

#include "storage/base/status.h"

namespace veduta {

// The host of "HOST:PORT" or of "HOST", in lower case.
std::string HostOf(const std::string& address);
// localhost, 127.0.0.1 or [::1].
bool IsThisMachine(const std::string& host);
// Whether the address is one of these hosts with a port.
bool IsLoopbackWithPort(const std::string& address);

// A socket that listens at HOST:PORT: localhost, an address of IPv4 as it is written with dots, or
// one of IPv6 in brackets; port 0 is any that is free. kIoError.
Result<kj::AutoCloseFd> ListenAt(const std::string& address);

}  // namespace veduta
