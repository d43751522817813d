// SPDX-License-Identifier: Apache-2.0
#pragma once
// When a photo was taken, by what it says of itself.

#include <cstdint>
#include <optional>

namespace veduta {

// What the clock of the camera showed. Only where the photo tells the offset of that clock is the
// moment known; otherwise it is somewhere within the zones of the earth.
struct TakenTime {
  int64_t local_unix_s = 0;         // of that clock, as if it were UTC; seconds since 1970
  std::optional<int32_t> offset_s;  // of it to UTC, seconds, positive in the east
  bool operator==(const TakenTime&) const = default;
};

// The bounds of what is kept: 1826, of which the oldest photograph is, to 9999; and the zones that
// there are on the earth (UTC-12 to UTC+14).
inline constexpr int64_t kTakenUnixSMin = -4'544'208'000, kTakenUnixSMax = 253'402'300'799;
inline constexpr int32_t kTakenOffsetSMin = -12 * 3600, kTakenOffsetSMax = 14 * 3600;

}  // namespace veduta
