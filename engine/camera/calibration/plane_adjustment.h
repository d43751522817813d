// SPDX-License-Identifier: Apache-2.0
#pragma once
// The final bundle adjustment of a calibration (R5): intrinsics, forward distortion, poses and
// nearly planar points.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "storage/base/status.h"
#include "storage/base/transform.h"
#include "storage/model/camera.h"

namespace veduta {

// In the order of the parameters' covariance.
inline constexpr std::array<const char*, 8> kIntrinsicNames = {"fx", "fy", "cx", "cy",
                                                               "k1", "k2", "u0", "v0"};
std::array<double, 8> IntrinsicsOf(const CameraModel& model);
CameraModel WithIntrinsics(CameraModel model, const std::array<double, 8>& values);

struct PlaneObservation {
  uint32_t view = 0, point = 0;
  Eigen::Vector2d px;
  double sigma_px = 1;  // > 0
};

// Everything that is adjusted. World: the plane is z = 0.
struct PlaneScene {
  CameraModel camera;
  std::vector<Rigid3> cams_from_world;
  std::vector<Eigen::Vector3d> points;
};

struct PlaneAdjustmentOptions {
  bool is_aspect_free = false;  // fy / fx; otherwise it stays as it is
  double plane_sigma =
      0.003;  // > 0; height of a point over the plane, in the points' RMS distance from their mean
  double distortion_center_sigma =
      0.03;  // > 0; how far (u0, v0) is thought to lie from (cx, cy), in longer sides:
             // decides only where a lens distorts so little that the photos cannot
  double loss_scale = 2.5;  // > 0, in sigma; Cauchy's loss
  uint32_t iterations_max = 100;
  double function_tolerance = 1e-10;  // > 0; relative

  Status Check() const;  // the first violated bound
};

struct PlaneAdjustment {
  Eigen::Matrix<double, 8, 8> covariance =
      Eigen::Matrix<double, 8, 8>::Zero();  // of kIntrinsicNames; px
  bool is_determined =
      false;  // false: the covariance means nothing, the observations leave an intrinsic open
  std::vector<Eigen::Vector2d> residuals_px;  // one an observation: projected - observed
  double sigma_scale =
      1;  // what the observations' sigmas are to be multiplied with to explain the residuals
  double cost = 0;  // half the sum of squares, in sigma, with the loss
};

// Minimises the reprojection errors over sigma, with Cauchy's loss, and weak priors as in the
// options. The gauge is held by the plane's prior and by two points far apart whose x and y stay;
// their heights are free.
//
// Every view and point needs an observation; views and points without one make it undetermined. The
// covariance is that of the least squares without the loss, times sigma_scale^2. One thread:
// repeatable. O(iterations * (observations + points * (views that see one)^2 + views^3)).
// kInvalidArgument if there are fewer than 2 points or the solver fails.
Result<PlaneAdjustment> AdjustPlane(const std::vector<PlaneObservation>& observations,
                                    const PlaneAdjustmentOptions& options, PlaneScene* scene);

}  // namespace veduta
