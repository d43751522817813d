// SPDX-License-Identifier: Apache-2.0
#pragma once
// The depths that are swept for a key view.

#include <cstdint>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

// Part of the version of every raw depth map: raise it whenever a change of the code changes what
// DepthRangeOf returns (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kDepthRangeVersion = 1;

// Along the key view's z, world units; 0 < near < far.
struct DepthRange {
  double near = 0, far = 0;
};

// From the depths of the points that the view sees: their 1st to 99th percentile, widened on both
// sides by `margin` (0.25: a quarter) of that range in inverse depth, for walls go on beside the
// outermost point; far is at most 100 times the 99th percentile. Depths that are not positive do
// not count. kInvalidArgument when fewer than 8 are left, or the margin is not in [0, 10].
Result<DepthRange> DepthRangeOf(std::vector<double> depths, double margin);

}  // namespace veduta
