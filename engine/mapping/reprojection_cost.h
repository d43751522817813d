// SPDX-License-Identifier: Apache-2.0
#pragma once
// The reprojection error as a Ceres cost function with analytic derivatives.

#include <ceres/ceres.h>

#include <Eigen/Core>

#include "engine/matching/pinhole.h"

namespace veduta {

// A pose as Ceres sees it: quaternion x y z w, then translation. Its tangent is a rotation vector in the camera
// frame, applied on the left, then the change of translation.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  // [I; 0]: the cost function writes derivatives by the tangent into the first six columns and zero into the last,
  // which saves the chain rule through the quaternion.
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// residual = projection(R X + t) - x_px, over pose [7] and point [3]. A point behind the camera gets a large constant
// error without derivatives, so that the step that took it there is refused.
class ReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const Pinhole& camera, const Eigen::Vector2d& x_px) : camera_(camera), x_px_(x_px) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  const Pinhole camera_;
  const Eigen::Vector2d x_px_;
};

// The same with the pose held, over the point [3] alone.
class FixedPoseReprojectionCost final : public ceres::SizedCostFunction<2, 3> {
 public:
  FixedPoseReprojectionCost(const Rigid3& cam_from_world, const Pinhole& camera, const Eigen::Vector2d& x_px)
      : rotation_(cam_from_world.rotation.toRotationMatrix()),
        translation_(cam_from_world.translation),
        camera_(camera),
        x_px_(x_px) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  const Eigen::Matrix3d rotation_;
  const Eigen::Vector3d translation_;
  const Pinhole camera_;
  const Eigen::Vector2d x_px_;
};

}  // namespace veduta
