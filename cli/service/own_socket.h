// SPDX-License-Identifier: Apache-2.0
#pragma once
// The socket in a database's folder by which the commands of its owner reach the daemon.

#include <kj/io.h>

#include <optional>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// Its name in the folder.
inline constexpr const char* kSocketName = "daemon.sock";

// Listens at the socket of the database, which only its owner may reach; one that a killed daemon
// has left is replaced. For who has the database open for writing. It goes with RemoveSocket.
// kIoError.
Result<kj::AutoCloseFd> ListenAtSocket(const std::string& database);
void RemoveSocket(const std::string& database);
// Listens at a socket that its owner alone may reach, anywhere. One that nobody listens at any more
// is replaced; kIoError where somebody does, or where something else has the name.
Result<kj::AutoCloseFd> ListenAtPath(const std::string& path);
// A connection to the daemon of the database; nothing where none runs.
std::optional<kj::AutoCloseFd> ConnectToSocket(const std::string& database);

}  // namespace veduta
