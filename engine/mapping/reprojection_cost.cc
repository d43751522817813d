// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/reprojection_cost.h"

#include <algorithm>

namespace veduta {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

constexpr double kDepthMin = 1e-9;
constexpr double kBehindError_px = 1e4;

Eigen::Quaterniond RotationOf(const double* pose) {
  return Eigen::Map<const Eigen::Quaterniond>(pose);
}

// Projects and, where wanted, differentiates by the point in the camera frame.
void ProjectWithDerivative(const Pinhole& camera, const Eigen::Vector3d& p, const Eigen::Vector2d& x_px,
                           double* residuals, Matrix23* derivative) {
  if (p.z() < kDepthMin) {
    residuals[0] = residuals[1] = kBehindError_px;
    derivative->setZero();
    return;
  }
  const double inverse = 1.0 / p.z(), u = p.x() * inverse, v = p.y() * inverse;
  residuals[0] = camera.fx * u + camera.cx - x_px.x();
  residuals[1] = camera.fy * v + camera.cy - x_px.y();
  *derivative << camera.fx * inverse, 0, -camera.fx * u * inverse, 0, camera.fy * inverse, -camera.fy * v * inverse;
}

}  // namespace

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Vector3d omega(delta[0], delta[1], delta[2]);
  const double angle = omega.norm();
  Eigen::Quaterniond turn(1, 0.5 * omega.x(), 0.5 * omega.y(), 0.5 * omega.z());
  if (angle > 1e-12) turn = Eigen::Quaterniond(Eigen::AngleAxisd(angle, omega / angle));
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = (turn * RotationOf(x)).normalized();
  for (int i = 0; i < 3; ++i) x_plus_delta[4 + i] = x[4 + i] + delta[3 + i];
  return true;
}

bool PoseManifold::PlusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topRows<6>().setIdentity();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Eigen::AngleAxisd turn(RotationOf(y) * RotationOf(x).conjugate());
  Eigen::Map<Eigen::Vector3d>{y_minus_x} = turn.angle() * turn.axis();
  for (int i = 0; i < 3; ++i) y_minus_x[3 + i] = y[4 + i] - x[4 + i];
  return true;
}

bool PoseManifold::MinusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.leftCols<6>().setIdentity();
  return true;
}

bool ReprojectionCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 4), point(parameters[1]);
  const Eigen::Matrix3d r = RotationOf(parameters[0]).toRotationMatrix();
  const Eigen::Vector3d rotated = r * point;
  Matrix23 derivative;
  ProjectWithDerivative(camera_, rotated + t, x_px_, residuals, &derivative);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
    Eigen::Matrix3d turn;  // derivative of the rotated point by the rotation vector: -[R X]x
    turn << 0, rotated.z(), -rotated.y(), -rotated.z(), 0, rotated.x(), rotated.y(), -rotated.x(), 0;
    by_pose.leftCols<3>() = derivative * turn;
    by_pose.middleCols<3>(3) = derivative;
    by_pose.col(6).setZero();
  }
  if (jacobians[1] != nullptr) Eigen::Map<Matrix23>{jacobians[1]} = derivative * r;
  return true;
}

bool FixedPoseReprojectionCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Map<const Eigen::Vector3d> point(parameters[0]);
  Matrix23 derivative;
  ProjectWithDerivative(camera_, rotation_ * point + translation_, x_px_, residuals, &derivative);
  if (jacobians != nullptr && jacobians[0] != nullptr) Eigen::Map<Matrix23>{jacobians[0]} = derivative * rotation_;
  return true;
}

}  // namespace veduta
