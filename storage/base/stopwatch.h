// SPDX-License-Identifier: Apache-2.0
#pragma once
// Wall time since the last lap, for the figures that `add` reports; never for a decision.

#include <chrono>

namespace veduta {

class Stopwatch {
 public:
  double LapMs() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace veduta
