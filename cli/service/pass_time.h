// SPDX-License-Identifier: Apache-2.0
#pragma once
// How long a dense pass may work: it ends between two pieces once the time is over.

#include <chrono>
#include <functional>
#include <stop_token>

#include "storage/base/status.h"

namespace veduta {

// The longest time that may be given: a century.
inline constexpr double kPassHoursMax = 1e6;

// kCancelled: what is said of a pass that has ended so.
Status PassTimeIsOver(double hours);

// One for each pass, from its begin on. On one thread, but for `also`, which may be asked to stop
// by any.
class PassTime final {
 public:
  // `hours` from now on, 0 to kPassHoursMax; 0: as long as it takes. `also`: who else may ask it to
  // stop, then at once.
  PassTime(double hours, const std::stop_token& also)
      : hours_(hours),
        begin_(std::chrono::steady_clock::now()),
        on_stop_(also, [this] { stop_.request_stop(); }) {}
  PassTime(const PassTime&) = delete;
  PassTime& operator=(const PassTime&) = delete;

  std::stop_token token() const { return stop_.get_token(); }
  // To be called between pieces (DensifyRequest::progress): asks to stop where the time is over.
  void Look();
  // Whether the pass, which has ended so, has since the time is over.
  bool HasEnded(const Status& pass) const {
    return is_over_ && pass.code() == StatusCode::kCancelled;
  }
  // What the pass has ended with; where it has since the time is over, that is said.
  Status EndOf(const Status& pass) const { return HasEnded(pass) ? PassTimeIsOver(hours_) : pass; }

 private:
  const double hours_;
  const std::chrono::steady_clock::time_point begin_;
  bool is_over_ = false;
  std::stop_source stop_;
  std::stop_callback<std::function<void()>> on_stop_;  // destroyed before what it stops
};

}  // namespace veduta
