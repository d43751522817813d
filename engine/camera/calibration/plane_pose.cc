// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/plane_pose.h"

#include <Eigen/Dense>

#include "engine/camera/calibration/homography.h"

namespace veduta {

std::optional<PlanePose> EstimatePlanePose(std::span<const Eigen::Vector2d> plane,
                                           std::span<const Eigen::Vector2d> x, double error_max,
                                           uint64_t seed) {
  auto homography = EstimateHomography(plane, x, error_max, seed);
  if (!homography) return std::nullopt;
  // Oriented: the third coordinate, the depth of the points, is positive.
  const Eigen::Matrix3d& h = homography->b_from_a;
  const double scale = 2 / (h.col(0).norm() + h.col(1).norm());
  if (!std::isfinite(scale)) return std::nullopt;
  Eigen::Matrix3d near;
  near << scale * h.col(0), scale * h.col(1), scale * scale * h.col(0).cross(h.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(near, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (rotation.determinant() < 0) return std::nullopt;
  PlanePose pose;
  pose.cam_from_world = {Eigen::Quaterniond(rotation).normalized(), scale * h.col(2)};
  pose.inliers = std::move(homography->inliers);
  return pose;
}

}  // namespace veduta
