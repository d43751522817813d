// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/homography.h"

#include <Eigen/LU>
#include <vector>

#include "engine/matching/sampling.h"

namespace veduta {
namespace {

Eigen::Matrix3d ThroughFour(std::span<const Eigen::Vector2d> x_a,
                            std::span<const Eigen::Vector2d> x_b, const std::vector<int>& sample) {
  Eigen::Matrix<double, 8, 8> system;
  Eigen::Matrix<double, 8, 1> right;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d &a = x_a[sample[k]], &b = x_b[sample[k]];
    system.row(2 * k) << a.x(), a.y(), 1, 0, 0, 0, -b.x() * a.x(), -b.x() * a.y();
    system.row(2 * k + 1) << 0, 0, 0, a.x(), a.y(), 1, -b.y() * a.x(), -b.y() * a.y();
    right.segment<2>(2 * k) = b;
  }
  const Eigen::Matrix<double, 8, 1> h = system.partialPivLu().solve(right);
  Eigen::Matrix3d b_from_a;
  b_from_a << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return b_from_a;
}

}  // namespace

Homography FindHomography(std::span<const Eigen::Vector2d> x_a,
                          std::span<const Eigen::Vector2d> x_b, double distance_max,
                          int sample_count, uint64_t seed) {
  Homography best;
  const uint32_t n = static_cast<uint32_t>(x_a.size());
  if (n < 4) return best;
  SeededRandom random(seed);
  std::vector<int> sample(4);
  for (int t = 0; t < sample_count; ++t) {
    DrawDistinct(random, n, sample);
    Homography found{ThroughFour(x_a, x_b, sample)};
    if (!found.b_from_a.allFinite()) continue;
    for (uint32_t i = 0; i < n; ++i)
      found.inlier_count += found.Explains(x_a[i], x_b[i], distance_max);
    if (found.inlier_count > best.inlier_count) best = found;
  }
  return best;
}

}  // namespace veduta
