// SPDX-License-Identifier: Apache-2.0
#pragma once
// The daemon's HTTP: connections, limits on what strangers send, and the way of each request to the
// service and back. A few threads share one socket; by Cap'n Proto's kj-http.

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "cli/service/city_service.h"
#include "storage/base/status.h"

namespace veduta {

struct HttpDoorOptions {
  // "HOST:PORT". Where whoever reaches the door may do anything, the host must be this machine:
  // localhost, 127.0.0.1 or [::1]; otherwise it may be any address of it. Port 0: any that is free.
  std::string address = "127.0.0.1:8484";
  // The service lets nobody in without a token (CityService::asks_for_tokens).
  bool asks_for_tokens = false;
  // The folder of the database: its owner's commands are served at a socket there (own_socket.h).
  // Empty: there is none.
  std::string database;
  // Addresses of proxies whose word it is where a request comes from (X-Forwarded-For); others are
  // not believed. By these the reports of one sender are counted.
  std::vector<std::string> proxies = {};
  // The largest body of a request, 1 to 2^40: photos of 100 Mpx fit. Chosen by hand.
  uint64_t body_bytes_max = 128ull << 20;
  // Of all bodies together that are in memory: of photos until they are on the disk, of questions
  // until they are answered. At least body_bytes_max. Chosen by hand.
  uint64_t bodies_bytes_max = 512ull << 20;
  // Of all answers that are being sent, those that are larger than 64 KiB; 1 to 2^40. A larger one
  // is sent alone. Chosen by hand.
  uint64_t answers_bytes_max = 512ull << 20;
  // Connections at the same time, 1 to 100,000. More wait until one ends. Chosen by hand.
  uint32_t connections_max = 512;
  // Threads that take connections, 1 to 64; questions that are answered at once are answered by
  // them. Chosen by measurement (docs/benchmarks.md).
  uint32_t threads = 2;

  Status Check() const;  // the first violated bound, named with its value
};

// Serves until a stop is requested; then closes the service, and gives the requests that are at
// work five seconds to be answered. `listening` is told the address, from this thread, once
// connections are taken.
// kInvalidArgument for the options; kIoError where nothing can listen there.
Status ServeHttp(CityService* service, const HttpDoorOptions& options, std::stop_token stop,
                 const std::function<void(const std::string& address)>& listening);

}  // namespace veduta
