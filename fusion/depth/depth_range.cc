// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/depth_range.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr size_t kDepthCountMin = 8;
constexpr double kFarthest = 100;  // times the 99th percentile
constexpr double kNarrowest =
    1.05;  // far / near: points on one plane still leave something to sweep

}  // namespace

Result<DepthRange> DepthRangeOf(std::vector<double> depths, double margin) {
  if (!(margin >= 0 && margin <= 10))
    return Status::InvalidArgument("margin is " + std::to_string(margin));
  std::erase_if(depths, [](double z) { return !(z > 0 && std::isfinite(z)); });
  if (depths.size() < kDepthCountMin) {
    return Status::InvalidArgument("a depth range takes " + std::to_string(kDepthCountMin) +
                                   " points in front; here are " + std::to_string(depths.size()));
  }
  std::sort(depths.begin(), depths.end());
  const size_t trimmed = depths.size() / 100;
  double near = depths[trimmed], far = depths[depths.size() - 1 - trimmed];
  if (far < near * kNarrowest) {
    const double middle = std::sqrt(near * far);
    near = middle / std::sqrt(kNarrowest), far = middle * std::sqrt(kNarrowest);
  }
  const double widening = margin * (1 / near - 1 / far);
  const double far_inverse = std::max(1 / far - widening, 1 / (far * kFarthest));
  return DepthRange{1 / (1 / near + widening), 1 / far_inverse};
}

}  // namespace veduta
