// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads the bodies of requests, whole or in parts, within limits on their bytes and their time.

#include <kj/async-io.h>
#include <kj/timer.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "cli/service/http_message.h"

namespace veduta {

// A number of things that all threads together may have: bytes of bodies, connections.
class Budget final {
 public:
  explicit Budget(uint64_t max) : max_(max) {}
  // False, and nothing is taken, where there is not so much left.
  bool Take(uint64_t count) {
    uint64_t before = used_;
    do {
      if (count > max_ - before) return false;
    } while (!used_.compare_exchange_weak(before, before + count));
    return true;
  }
  void Give(uint64_t count) { used_ -= count; }

 private:
  const uint64_t max_;
  std::atomic<uint64_t> used_ = 0;
};

// The bytes of one body, which count in the budget as long as it is there.
struct BodyShare {
  explicit BodyShare(std::shared_ptr<Budget> b) : budget(std::move(b)) {}
  BodyShare(const BodyShare&) = delete;
  BodyShare& operator=(const BodyShare&) = delete;
  ~BodyShare() { budget->Give(taken); }

  const std::shared_ptr<Budget> budget;
  uint64_t taken = 0;
};

// A request on its way.
struct Arriving {
  explicit Arriving(std::shared_ptr<Budget> budget)
      : share(std::make_shared<BodyShare>(std::move(budget))) {}

  HttpRequest request;
  std::shared_ptr<BodyShare> share;
  std::optional<HttpAnswer> refusal;  // why no more of it was read
  bool has_ended = false;             // all of the body has come
};

// For one thread.
class BodyReader final {
 public:
  BodyReader(kj::Timer* timer, uint64_t bytes_max) : timer_(*timer), bytes_max_(bytes_max) {}

  // Reads until the end, or sets arriving->refusal. Fails where the connection breaks
  // (DISCONNECTED), or takes too long for a piece (OVERLOADED): so much of the body as its share
  // has taken has come then. The body and this reader must live until it is done.
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
