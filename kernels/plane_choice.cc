// SPDX-License-Identifier: Apache-2.0
#include "kernels/plane_choice.h"

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Sums of a cost (127 at most) and a penalty stay within a byte.
constexpr uint8_t kPenaltySmallMax = 127, kPenaltyLargeMax = 128;

}  // namespace

Status ScanlineOptions::Check() const {
  OptionBounds bounds;
  bounds.Between("penalty_small", penalty_small, 0, kPenaltySmallMax);
  for (const uint8_t penalty : penalty_large)
    bounds.Between("penalty_large", penalty, 0, kPenaltyLargeMax);
  return bounds.status();
}

}  // namespace veduta
