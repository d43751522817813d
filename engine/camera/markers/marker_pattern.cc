// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/marker_pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace veduta {

bool IsMarkerDark(MarkerId id, double x, double y) {
  const double r2 = x * x + y * y;
  if (r2 > 1) return false;
  if (r2 > kMarkerCodeRadius * kMarkerCodeRadius) return true;
  if (r2 <= kMarkerBoardRadius * kMarkerBoardRadius) return (x > 0) == (y > 0);
  double turn = std::atan2(y, x) / (2 * std::numbers::pi);
  if (turn < 0) turn += 1;
  const int sector = std::min(static_cast<int>(turn * kMarkerBitCount), kMarkerBitCount - 1);
  return (MarkerWord(id) >> sector & 1) == 0;
}

}  // namespace veduta
