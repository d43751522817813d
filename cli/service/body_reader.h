// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads the bodies of requests, whole or in parts, within limits on their bytes and their time.

#include <kj/async-io.h>
#include <kj/timer.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "cli/service/divided_budget.h"
#include "cli/service/http_message.h"

namespace veduta {

// A request on its way.
struct Arriving {
  explicit Arriving(std::shared_ptr<DividedBudget> budget)
      : share(std::make_shared<DividedShare>(std::move(budget))) {}

  HttpRequest request;
  std::shared_ptr<DividedShare> share;
  size_t come_bytes = 0;              // of the body
  std::optional<HttpAnswer> refusal;  // why no more of it was read
  bool has_ended = false;             // all of the body has come
};

// For one thread.
class BodyReader final {
 public:
  BodyReader(kj::Timer* timer, uint64_t bytes_max) : timer_(*timer), bytes_max_(bytes_max) {}

  // Reads until the end, or sets arriving->refusal: 413 where the body is too large, 429 where the
  // bodies that arrive fill the memory, or those of its holder half of it, unless it is the owner's
  // or small. Fails where the connection breaks (DISCONNECTED), or takes too long for a piece
  // (OVERLOADED): come_bytes of the body have come then. The body and this reader must live until
  // it is done.
  kj::Promise<void> ReadAll(kj::AsyncInputStream& body, std::shared_ptr<Arriving> arriving) const;
  // The same until there is enough for a part.
  kj::Promise<void> ReadPart(kj::AsyncInputStream& body, std::shared_ptr<Arriving> arriving) const;

 private:
  kj::Promise<void> ReadPieces(kj::AsyncInputStream& body, std::shared_ptr<Arriving> arriving,
                               size_t enough_bytes) const;
  bool Fits(uint64_t bytes, Arriving* arriving) const;
  // Counts the bytes that have come, in all.
  bool Reserve(Arriving* arriving, uint64_t bytes) const;

  kj::Timer& timer_;
  const uint64_t bytes_max_;
};

}  // namespace veduta
