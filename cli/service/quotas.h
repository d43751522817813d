// SPDX-License-Identifier: Apache-2.0
#pragma once
// How much may be done with each token, so that one who sends without end leaves room for others.

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>

#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

// What there is of a measure fills again all the time, as fast as the quota says, up to what a day
// gives of photos and bytes, and ten seconds of requests. It is kept in memory: a daemon that
// begins anew begins with full measures. Requests without a token, which are the owner's or come
// where there are none, are not counted. Thread-safe.
class Quotas final {
 public:
  using Clock = std::chrono::steady_clock;
  // `usual` counts where a token has no quota of its own; none of its numbers is 0. `now` is for
  // tests.
  explicit Quotas(const TokenQuota& usual, std::function<Clock::time_point()> now = Clock::now)
      : usual_(usual), now_(std::move(now)) {}

  // Takes from the token's measures. The answer where there is not enough, 429 with the time after
  // which there will be: then nothing is taken.
  std::optional<HttpAnswer> TakeRequest(const HttpRequest& request);
  std::optional<HttpAnswer> TakePhoto(const HttpRequest& request, uint64_t size_bytes);
  // Gives back what was taken for a photo that was not stored for no fault of its own.
  void GivePhoto(const HttpRequest& request, uint64_t size_bytes);

 private:
  // What is left of one measure.
  struct Measure {
    double left = 0, full = 0, per_s = 0;
    void Fill(double seconds);
  };
  struct Measures {
    Measure photos, bytes, requests;
    Clock::time_point filled;
  };
  Measures& FilledMeasures(const HttpRequest& request);  // with the lock held

  const TokenQuota usual_;
  const std::function<Clock::time_point()> now_;
  std::mutex mutex_;
  std::map<uint32_t, Measures> measures_;  // by the tokens' numbers
};

}  // namespace veduta
