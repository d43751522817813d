// SPDX-License-Identifier: Apache-2.0
#pragma once
// The plane that most matches of two views lie on: a homography by RANSAC (Hartley and Zisserman,
// 4.1 and 4.8).

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace veduta {

struct Homography {
  Eigen::Matrix3d b_from_a = Eigen::Matrix3d::Zero();  // its last element is 1
  uint32_t inlier_count = 0;                           // 0 where there is none

  // Whether it carries a to b, in front of both, with an error below distance_max.
  bool Explains(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double distance_max) const {
    const Eigen::Vector3d p = b_from_a.col(0) * a.x() + b_from_a.col(1) * a.y() + b_from_a.col(2);
    return p.z() > 0 && (p.head<2>() / p.z() - b).norm() < distance_max;
  }
};

// The best of those of `sample_count` random samples of four matches x_a[i] <-> x_b[i], in
// normalised image coordinates. Deterministic in its inputs; thread-safe; O(samples * matches).
Homography FindHomography(std::span<const Eigen::Vector2d> x_a,
                          std::span<const Eigen::Vector2d> x_b, double distance_max,
                          int sample_count, uint64_t seed);

}  // namespace veduta
