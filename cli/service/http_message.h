// SPDX-License-Identifier: Apache-2.0
#pragma once
// A request to the daemon and the answer to it, apart from how the two travel.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cli/service/client_presence.h"
#include "cli/wire/json.h"
#include "engine/engine.h"
#include "storage/base/status.h"

namespace veduta {

struct HttpRequest {
  std::string method;                        // "GET", "POST"; HEAD arrives as GET
  std::vector<std::string> path;             // its parts, decoded: {"v1", "photos", "anna/1.jpg"}
  std::map<std::string, std::string> query;  // decoded
  std::string content_type;                  // without parameters, in lower case; empty: none
  std::string if_none_match;                 // the header's value; empty: none
  bool prefers_async = false;                // "Prefer: respond-async" (RFC 7240)
  bool is_of_owner = false;                  // it came by the socket of the database's owner
  std::string address = {};                  // of IP that it comes from; empty: none, or not known
  std::string token;                         // that it carries (RFC 6750); empty: none
  std::string who;                           // whose token that is, once it was found good
  std::optional<Role> role;                  // of that token
  uint32_t token_number = 0;                 // then; 0: there is none
  TokenQuota quota;                          // the token's own
  bool may_name_others = true;               // photos may be sent under any contributor's name
  Sight sight = {.sees_hidden = false};      // what is told to whoever asks
  // The headers that one route alone reads, by their names as HeadersOfRoutes has them.
  std::map<std::string, std::string> headers;
  std::vector<uint8_t> body;
  std::shared_ptr<const void> body_share;        // what is given back when the body goes
  std::shared_ptr<const ClientPresence> client;  // who waits for the answer; null: not known
};

struct HttpAnswer {
  uint32_t code = 200;
  std::string content_type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::vector<std::string> damages = {};  // met, and not shown in the answer; for the log
  bool is_of_disk = false;                // a failure of the disk (kIoError)
  // For the log alone: whose token it was, and the number in line of the photo that was sent.
  std::string who = {};
  uint64_t upload = 0;
  std::string holder = {};  // HolderOf the request, once it was let in
};

// Headers that one route alone reads.
std::span<const char* const> HeadersOfRoutes();

// The words that go with a code in the first line of an answer.
const char* HttpPhrase(uint32_t code);

HttpAnswer JsonAnswer(uint32_t code, const Json& value);
// A failure as RFC 9457 has it (application/problem+json). `detail` says what is wrong and what to
// do; `code` is 400 or greater. `photo`, unless null: what became of the photo, as a member of that
// name.
HttpAnswer Problem(uint32_t code, const std::string& detail, const Json& photo = {});
// The failure of an operation: 400 for an argument, 404, 409 for what exists already, 503 where the
// same request may succeed later, with Retry-After, otherwise 500, with `damaged` as a member where
// the database is.
HttpAnswer ProblemOf(const Status& status);

// A problem that passes: with Retry-After.
HttpAnswer ComeAgain(uint32_t code, const std::string& detail, uint32_t seconds);

// "text/plain" of "Text/Plain; charset=utf-8".
std::string MediaType(std::string header);
// A header of the answer, or one of HeadersOfRoutes; empty where it has none.
std::string HeaderOf(const HttpAnswer& answer, const std::string& name);
std::string HeaderOf(const HttpRequest& request, const std::string& name);
// The token in the value of a header `Authorization`; empty where it has none (RFC 6750).
std::string BearerOf(const std::string& header);
// A parameter of the query; `otherwise` where it is not given.
std::string Parameter(const HttpRequest& request, const std::string& name,
                      const std::string& otherwise = "");
// The answer to a request that should carry a photo and does not; nothing where it does.
std::optional<HttpAnswer> RefuseBody(const HttpRequest& request);

}  // namespace veduta
