// SPDX-License-Identifier: Apache-2.0
#pragma once
// The least-squares problem of a bundle adjustment, in arrays of its own, so that the map changes
// only after a solve has succeeded.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/mapping/bundle_options.h"
#include "storage/base/transform.h"
#include "storage/model/pinhole.h"

namespace veduta {

struct BundleObservation {
  uint32_t image;
  Eigen::Vector2d x_px;
};

struct BundleProblem {
  std::vector<Rigid3> cams_from_world;  // one for each image, the free ones first
  std::vector<Pinhole> cameras;         // one for each image, in the same order
  uint32_t free_count = 0;
  std::vector<Eigen::Vector3d> points;
  std::vector<uint32_t> first_observation;      // [points + 1]
  std::vector<BundleObservation> observations;  // of point 0, then of point 1, and so on
};

// What the observations of a point count (BundleOptions::two_view_weight).
inline double PointWeight(const BundleProblem& problem, size_t point,
                          const BundleOptions& options) {
  const uint32_t views = problem.first_observation[point + 1] - problem.first_observation[point];
  return views > 2 ? 1.0 : options.two_view_weight;
}

struct BundleSolution {
  bool is_usable = false;
  uint32_t iterations = 0;                  // steps tried
  double initial_cost = 0, final_cost = 0;  // half the sum of weight rho(squared px)
};

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix23d = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

// projection(x_cam) - x_px, and its derivative by x_cam. A point behind the camera gets a large
// constant error without derivatives, so that the step that took it there is refused. Both
// constants were chosen by hand: any error far above a photo's errors will do, and any depth near
// 0.
inline Eigen::Vector2d ReprojectionError(const Pinhole& camera, const Eigen::Vector3d& x_cam,
                                         const Eigen::Vector2d& x_px, Matrix23d* derivative) {
  constexpr double kDepthMin = 1e-9, kBehindError_px = 1e4;
  if (x_cam.z() < kDepthMin) {
    if (derivative != nullptr) derivative->setZero();
    return {kBehindError_px, kBehindError_px};
  }
  const double inverse = 1.0 / x_cam.z(), u = x_cam.x() * inverse, v = x_cam.y() * inverse;
  if (derivative != nullptr) {
    *derivative << camera.fx * inverse, 0, -camera.fx * u * inverse, 0, camera.fy * inverse,
        -camera.fy * v * inverse;
  }
  return {camera.fx * u + camera.cx - x_px.x(), camera.fy * v + camera.cy - x_px.y()};
}

// A pose moved along its tangent: a rotation vector in the camera frame, applied on the left, and a
// change of translation.
inline Rigid3 MovePose(const Rigid3& cam_from_world, const Vector6d& tangent) {
  const Eigen::Vector3d omega = tangent.head<3>();
  const double angle = omega.norm();
  Eigen::Quaterniond turn(1, 0.5 * omega.x(), 0.5 * omega.y(), 0.5 * omega.z());
  if (angle > 1e-12) turn = Eigen::Quaterniond(Eigen::AngleAxisd(angle, omega / angle));
  return {(turn * cam_from_world.rotation).normalized(),
          cam_from_world.translation + tangent.tail<3>()};
}

}  // namespace veduta
