// SPDX-License-Identifier: Apache-2.0
#pragma once
// One colour from several photos' opinions.

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace veduta {

struct ColorSample {
  Eigen::Vector3f light;  // >= 0
  float weight;           // > 0
  uint32_t image;         // breaks ties, so that the order of samples does not matter
};

struct RobustColor {
  Eigen::Vector3f light = Eigen::Vector3f::Zero();
  uint32_t count = 0;  // samples that were believed
};

// The weighted mean of the samples that lie near their weighted median, channel by channel: nearer,
// in the square root of light (close to sRGB's values, 1: white), than `tolerance` or `deviations`
// robust standard deviations (1.4826 times the weighted median distance), whichever is more. Of two
// that disagree the heavier stands.
//
// Sorts the samples, heaviest first, and uses the first `count_max`. No samples: zero. O(n log n).
RobustColor RobustMean(std::span<ColorSample> samples, uint32_t count_max, float deviations,
                       float tolerance);

}  // namespace veduta
