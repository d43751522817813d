// SPDX-License-Identifier: Apache-2.0
#pragma once
// Extrema of the difference of Gaussians, placed between the samples. Lowe 2004, section 4.

#include <cstdint>
#include <optional>

#include "engine/features/octave.h"

namespace veduta {

struct ExtremumLimits {
  double contrast_min = 0.04 / 3;  // |DoG| at the extremum, in shares of the gray range
  double edge_ratio_max = 10.0;    // of the principal curvatures; Lowe 2004, section 4.1
};

// Fits a quadric to the 3 x 3 x 3 differences about (level, y, x) of `octave` and steps to the
// sample nearest its extremum, at most kRefineSteps times. Reads rows y - kRefineReach .. y +
// kRefineReach. Nothing if the steps leave the octave or do not end, or the extremum fails the
// limits.
std::optional<Extremum> RefineExtremum(const OctaveRows& octave, int level, int y, int x,
                                       const ExtremumLimits& limits);

}  // namespace veduta
