// SPDX-License-Identifier: Apache-2.0
#pragma once
// The daemon's Cap'n Proto RPC: connections, and limits on them. A few threads share one socket, as
// HTTP's do; a connection stays on the thread that took it.

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "cli/service/city_service.h"
#include "storage/base/status.h"

namespace veduta {

struct RpcDoorOptions {
  // "unix:PATH": a socket that its owner alone may reach, who needs no token. Or "HOST:PORT", where
  // the same holds as for HTTP: this machine alone until there are tokens; port 0 is any that is
  // free.
  std::string address;
  // The service lets nobody in without a token (CityService::asks_for_tokens).
  bool asks_for_tokens = false;
  // Connections at the same time, 1 to 100,000. More wait until one ends. Chosen by hand.
  uint32_t connections_max = 256;
  // Of all connections together: bytes of photos that arrive and of points that are being read,
  // from 128 MiB, which one photo may have, to 2^40. Chosen by hand, as those of HTTP.
  uint64_t bytes_max = 512ull << 20;
  // Threads that take connections, 1 to 64, as of HTTP.
  uint32_t threads = 2;

  Status Check() const;  // the first violated bound, named with its value
};

// Serves while it lives. Thread-safe.
class RpcDoor final {
 public:
  // `failed` is called from a thread of the door's where that cannot go on. kInvalidArgument for
  // the options; kIoError where nothing can listen there.
  static Result<std::unique_ptr<RpcDoor>> Open(CityService* service, const RpcDoorOptions& options,
                                               std::function<void(const Status&)> failed);
  // Closes the service, and gives the calls that are at work five seconds to be answered.
  ~RpcDoor();
  RpcDoor(const RpcDoor&) = delete;
  RpcDoor& operator=(const RpcDoor&) = delete;

  // Takes no connection from now on and closes what is open, as the destructor does, which waits
  // for it.
  void Stop();
  // Where it listens, with the port.
  const std::string& address() const;

 private:
  struct Parts;
  explicit RpcDoor(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace veduta
