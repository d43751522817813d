// SPDX-License-Identifier: Apache-2.0
#pragma once
// Who may ask the daemon what: by tokens, once there is one.

#include <atomic>
#include <optional>

#include "cli/service/city_route.h"
#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

// Before the first token was made, whoever reaches the daemon may do anything but what is the
// owner's; from then on each request needs a token whose role is enough. The owner, by the socket
// in the database's folder, needs none. Thread-safe.
class Gatekeeper final {
 public:
  // Reads whether there are tokens. Where that cannot be read, as while the files are closed, the
  // next request reads it first.
  Status Look(const Questions& ask) const;
  bool asks_for_tokens() const { return door_ != Door::kOpen; }
  // Whether the last look has found tokens; asks_for_tokens() is also true where it found out
  // nothing.
  bool has_tokens() const { return door_ == Door::kByToken; }

  // The answer to a request that may not be made: 401 without a good token, 403 where its role is
  // not enough. Otherwise notes in the request who makes it, and what may be told: what is hidden
  // to the owner and to curators alone. A contributor sends photos under the name of the token
  // alone.
  std::optional<HttpAnswer> Refuse(const Engine& engine, const CityRoute& route,
                                   HttpRequest* request) const;
  // The answer where the request, which may be made, names another contributor than it may.
  static std::optional<HttpAnswer> RefuseNaming(const HttpRequest& request);

 private:
  enum class Door : uint8_t { kUnread, kOpen, kByToken };

  mutable std::atomic<Door> door_ = Door::kUnread;
};

}  // namespace veduta
