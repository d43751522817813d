// SPDX-License-Identifier: Apache-2.0
#pragma once
// The final bundle adjustment of a calibration (R5): intrinsics, forward distortion, poses and
// points, which are nearly planar or anywhere.

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

// Everything that is adjusted. World: the plane is z = 0, where there is one.
struct PlaneScene {
  std::vector<CameraModel> cameras{CameraModel()};  // one or more
  std::vector<uint32_t> camera_of_view;             // empty: all were taken by the first one
  std::vector<Rigid3> cams_from_world;
  std::vector<Eigen::Vector3d> points;

  // The first one, where it is the only one.
  CameraModel& camera() { return cameras.front(); }
  const CameraModel& camera() const { return cameras.front(); }
  uint32_t CameraOf(size_t view) const { return camera_of_view.empty() ? 0 : camera_of_view[view]; }
};

struct PlaneAdjustmentOptions {
  bool is_aspect_free = false;  // whether fy / fx is adjusted; otherwise it stays as it is
  // Whether the points lie about on the plane. Otherwise nothing is known of where they lie.
  bool is_planar = true;
  // > 0; the standard deviation of a point's height over the plane, over the RMS distance of the
  // points from their mean. 1.5 mm for sheets over a square metre of floor; chosen by hand.
  double plane_sigma = 0.003;
  // > 0; how far the centre of distortion is thought to lie from the principal point, over the
  // photo's longer side. It decides only where a lens distorts so little that the photos do not.
  // Chosen by hand; not measured.
  double distortion_center_sigma = 0.03;
  // >= 0; how far the principal point is thought to lie from the photo's middle, over the longer
  // side; 0: nothing is known.
  double principal_point_sigma = 0;
  // > 0; where Cauchy's loss begins to weigh an error less, in standard deviations. At 2.385 the
  // loss keeps 95 % of the least squares' efficiency on normal errors (Holland and Welsch 1977).
  double loss_scale = 2.5;
  uint32_t iterations_max = 100;  // [1, 1000000]; chosen by hand, it is rarely reached
  // > 0; the adjustment ends when a step lowers the cost by less than this part of it. Chosen by
  // hand: 1e4 times finer than Ceres's default, for the covariance is taken at the minimum.
  double function_tolerance = 1e-10;

  Status Check() const;  // the first violated bound
};

struct PlaneAdjustment {
  // Of each camera's intrinsics, in the order of kIntrinsicNames.
  std::vector<Eigen::Matrix<double, 8, 8>> covariances;
  // If false, the observations leave an intrinsic open, and the covariances mean nothing.
  bool is_determined = false;
  std::vector<Eigen::Vector2d> residuals_px;  // of each observation: projected minus observed
  // What the observations' sigmas must be multiplied by to explain the residuals.
  double sigma_scale = 1;
  double cost = 0;  // half the sum of the squared residuals, in sigma, after the loss

  const Eigen::Matrix<double, 8, 8>& covariance() const { return covariances.front(); }
};

// Minimises the reprojection errors over sigma, with Cauchy's loss, and weak priors as in the
// options. The gauge is held by the plane's prior and by two points far apart whose x and y stay,
// while their heights are free; without a plane by the first view, and how far the farthest one is.
//
// Every camera, view and point needs an observation; those without one make it undetermined. The
// covariance is that of the least squares without the loss, times sigma_scale^2. One thread:
// repeatable. O(iterations * (observations + points * (views that see one)^2 + views^3)).
// kInvalidArgument if there are fewer than 2 points, no view (fewer than 2 without a plane), or the
// solver fails.
Result<PlaneAdjustment> AdjustPlane(const std::vector<PlaneObservation>& observations,
                                    const PlaneAdjustmentOptions& options, PlaneScene* scene);

}  // namespace veduta
