// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the daemon tells of each request: nothing in it is a secret, so it may be kept.

#include <cstdint>
#include <string>

#include "cli/service/http_message.h"

namespace veduta {

struct RequestEntry {
  std::string id;         // answered as X-Request-Id
  const char* door = "";  // "http" or "rpc"
  std::string method;
  std::string route;    // as the OpenAPI document has it; empty: there is none
  std::string who;      // the name of the token; "owner" by the owner's socket; empty: nobody
  uint32_t status = 0;  // of RPC that of the request of HTTP which asks for the same
  uint64_t bytes = 0;   // of the answer
  double ms = 0;        // until all of it was sent
  uint64_t upload = 0;  // the photo's number in line; 0: none
};

// The client's own where it is 1 to 64 letters, digits, '.', '_' and '-'; otherwise 16 hexadecimal
// digits that no other request has. Thread-safe.
std::string RequestId(const std::string& of_client);
// The template of the path that the request is for; empty where there is none.
std::string RouteOf(const HttpRequest& request);
Json ToJson(const RequestEntry& entry);

}  // namespace veduta
