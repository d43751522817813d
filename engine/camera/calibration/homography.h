// SPDX-License-Identifier: Apache-2.0
#pragma once
// Homographies between two views of a plane, from points in common.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace veduta {

// b_from_a * a ~ b. Scaled to unit norm, and so that the third coordinate is positive for most of
// the points used.
struct RobustHomography {
  Eigen::Matrix3d b_from_a = Eigen::Matrix3d::Identity();
  std::vector<uint32_t> inliers;  // ascending
};

// Where H takes the place `a`, which must not go to infinity.
inline Eigen::Vector2d Transfer(const Eigen::Matrix3d& b_from_a, const Eigen::Vector2d& a) {
  return (b_from_a * a.homogeneous()).hnormalized();
}

// The direct linear transform with Hartley's normalisation, from at least 4 pairs; nothing if they
// are degenerate (three of four on a line, all in one place). [Hartley and Zisserman 2004,
// algorithm 4.2]
std::optional<Eigen::Matrix3d> FitHomography(std::span<const Eigen::Vector2d> a,
                                             std::span<const Eigen::Vector2d> b);

// The homography that most pairs agree on within `error_max`, measured in b in the units of its
// coordinates. Samples of four pairs are scored by the truncated squared error, and the best one is
// fitted again to its inliers. Nothing if fewer than 6 pairs agree. Deterministic in its inputs and
// the seed. O(samples * N), at most 1000 samples. Thread-safe.
std::optional<RobustHomography> EstimateHomography(std::span<const Eigen::Vector2d> a,
                                                   std::span<const Eigen::Vector2d> b,
                                                   double error_max, uint64_t seed);

// The gold standard: moves H and the true place of every point in a so that the squared distances
// to what was measured in both views, divided by their variances, are least. sigma_a and sigma_b
// hold one standard deviation for each pair. Levenberg-Marquardt from `start`. [Hartley and
// Zisserman 2004, algorithm 4.3]
Eigen::Matrix3d RefineHomography(const Eigen::Matrix3d& start, std::span<const Eigen::Vector2d> a,
                                 std::span<const Eigen::Vector2d> b,
                                 std::span<const double> sigma_a, std::span<const double> sigma_b);

}  // namespace veduta
