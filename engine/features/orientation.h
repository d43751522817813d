// SPDX-License-Identifier: Apache-2.0
#pragma once
// The dominant gradient directions about a point. Lowe 2004, section 5.

#include "engine/features/sift_kernels.h"

namespace veduta {

inline constexpr int kDirectionsMax = kOrientationBins / 2;

struct Directions {
  int count = 0;                    // >= 1
  float angle_deg[kDirectionsMax];  // [0, 360), ascending bins of the histogram
};

// Peaks of the histogram of directions within 4.5 sigma px of (x, y) that reach 0.8 of the highest.
Directions FindDirections(const SiftKernels& kernels, const GrayPlane& plane, double x, double y,
                          double sigma);

}  // namespace veduta
