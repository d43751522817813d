// SPDX-License-Identifier: Apache-2.0
#pragma once
// How much may be done with each token, so that one who sends without end leaves room for others.

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

// What there is of a measure fills again all the time, as fast as the quota says, up to what a day
// gives of photos, bytes, reports and contributions, and ten seconds of requests. Photos,
// contributions and requests without a token, which are the owner's or come where there are none,
// are not counted; reports are counted of all who come without one together, but the owner, and
// also by the address that they come from. Addresses are held in memory alone. Thread-safe.
class Quotas final {
 public:
  using Clock = std::chrono::steady_clock;
  // The clocks, and who remembers what was used; for tests these are their own.
  struct World {
    std::function<Clock::time_point()> now = Clock::now;
    std::function<int64_t()> unix_ms = [] {
      return std::chrono::duration_cast<std::chrono::milliseconds>(
                 std::chrono::system_clock::now().time_since_epoch())
          .count();
    };
    // Told of each change of photos, bytes, reports and contributions, one call at a time; requests
    // fill again in ten seconds, and are not remembered. May be empty.
    std::function<void(const TokenUse&)> keep = {};
  };
  // `usual` counts where a token has no quota of its own; none of its numbers is 0.
  Quotas(const TokenQuota& usual, World world) : usual_(usual), world_(std::move(world)) {}

  // What `keep` was told before the daemon ended; before anything is taken.
  void Restore(std::span<const TokenUse> uses);

  // Takes from the token's measures. The answer where there is not enough, 429 with the time after
  // which there will be: then nothing is taken.
  std::optional<HttpAnswer> TakeRequest(const HttpRequest& request);
  std::optional<HttpAnswer> TakePhoto(const HttpRequest& request, uint64_t size_bytes);
  std::optional<HttpAnswer> TakeReport(const HttpRequest& request);
  // Of a contribution that is to be opened.
  std::optional<HttpAnswer> TakeContribution(const HttpRequest& request);
  // Gives back what was taken for a photo that was not stored for no fault of its own, or that was
  // given up `after_s` seconds later: less by the share of a day that has passed, since all fills
  // again in a day.
  void GivePhoto(const HttpRequest& request, uint64_t size_bytes, double after_s = 0);

 private:
  // What is left of one measure.
  struct Measure {
    double left = 0, full = 0, per_s = 0;
    void Fill(double seconds);
  };
  struct Measures {
    Measure photos, bytes, requests, reports, contributions;
    Clock::time_point filled;
  };
  // What an address has left of reports.
  struct AddressMeasure {
    Measure reports;
    Clock::time_point filled;
  };
  // Both with the lock held. Where there are too many addresses, the one that has used least of its
  // reports is forgotten for a new one.
  Measures& FilledMeasures(const HttpRequest& request);
  // One of what is left of the measure, or the answer to who has had all of it.
  static std::optional<HttpAnswer> TakeOne(const char* what, Measure* measure);
  Measure& FilledReports(const std::string& address);
  std::optional<HttpAnswer> TryPhoto(const HttpRequest& request, double size_bytes);
  // Has what is used of the token's measures by now remembered.
  void Keep(const HttpRequest& request);

  const TokenQuota usual_;
  const World world_;
  std::mutex keep_mutex_;  // held while somebody remembers; taken before the next one
  std::mutex mutex_;
  std::map<uint32_t, Measures> measures_;            // by the tokens' numbers
  std::map<uint32_t, TokenUse> restored_;            // of tokens that have no measures yet
  std::map<std::string, AddressMeasure> addresses_;  // by SenderOf
};

}  // namespace veduta
