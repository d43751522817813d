// SPDX-License-Identifier: Apache-2.0
#pragma once
// Addresses by which this machine alone is reached.

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

// A socket that listens at such an address; port 0 is any that is free. kIoError.
Result<kj::AutoCloseFd> ListenOnLoopback(const std::string& address);

}  // namespace veduta
