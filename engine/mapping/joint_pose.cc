// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/joint_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/mapping/bundle_problem.h"
#include "engine/mapping/camera_system.h"
#include "engine/matching/two_view.h"

namespace veduta {
namespace {

// Of Levenberg-Marquardt. Chosen by hand; not measured.
constexpr int kStepsMax = 30;
constexpr double kDampingStart = 1e-3, kDampingMin = 1e-9, kDampingMax = 1e6;
constexpr double kCostShareMin = 1e-6;  // a step that gains less is the last

// What a point behind the camera costs, and a match with an image at the same place, which has no
// epipolar line: as much as an error of 45 degrees.
constexpr double kErrorWithoutImage = 1.0;

Eigen::Matrix3d Cross(const Eigen::Vector3d& x) {
  Eigen::Matrix3d matrix;
  matrix << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
  return matrix;
}

// The pose with the rotation exp([omega]x) R and the centre c + d, for a step (omega, d).
Rigid3 Moved(const Rigid3& pose, const Vector6d& step) {
  const Eigen::Vector3d omega = step.head<3>();
  Eigen::Quaterniond rotation = pose.rotation;
  if (omega.norm() > 0)
    rotation = Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm(), omega.normalized())) * rotation;
  rotation.normalize();
  return {rotation, -(rotation * (pose.Center() + step.tail<3>()))};
}

// The cost at a pose; half its gradient by (omega, d); and half the Gauss-Newton approximation of
// its Hessian.
class Linearized final {
 public:
  void AddPoint(const Rigid3& pose, const Eigen::Vector2d& x, const Eigen::Vector3d& point,
                double scale) {
    const Eigen::Vector3d p = pose * point;
    if (!(p.z() > 0)) return AddWithoutImage(scale);
    Eigen::Matrix<double, 2, 3> projection;
    projection << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
    Eigen::Matrix<double, 2, 6> jacobian;
    jacobian << -projection * Cross(p), -projection * pose.rotation.toRotationMatrix();
    Add(Eigen::Vector2d(p.hnormalized() - x), jacobian, scale);
  }

  // Sampson distances.
  void AddMatches(const Rigid3& pose, const PlacedMatches& matches) {
    const Rigid3 other_from_photo = matches.cam_from_world * pose.Inverse();
    const Eigen::Matrix3d turn = other_from_photo.rotation.toRotationMatrix();
    const Eigen::Matrix3d essential = EssentialFromPose(other_from_photo);
    std::array<Eigen::Matrix3d, 6> derivatives;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      derivatives[static_cast<size_t>(k)] = -essential * Cross(axis);
      derivatives[static_cast<size_t>(k) + 3] =
          Cross(matches.cam_from_world.rotation * axis) * turn;
    }
    for (size_t i = 0; i < matches.x.size(); ++i) {
      const Eigen::Vector3d a = matches.x[i].homogeneous(), b = matches.x_other[i].homogeneous();
      const Eigen::Vector3d line_b = essential * a, line_a = essential.transpose() * b;
      const double norm =
          std::sqrt(line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm());
      if (!(norm > 0)) {
        AddWithoutImage(matches.scale);
        continue;
      }
      const double error = b.dot(line_b) / norm;
      Eigen::Matrix<double, 1, 6> jacobian;
      for (size_t k = 0; k < 6; ++k) {
        const Eigen::Vector3d by_b = derivatives[k] * a, by_a = derivatives[k].transpose() * b;
        const double of_norm =
            line_b.head<2>().dot(by_b.head<2>()) + line_a.head<2>().dot(by_a.head<2>());
        jacobian[static_cast<Eigen::Index>(k)] = (b.dot(by_b) - error * of_norm / norm) / norm;
      }
      Add(Eigen::Matrix<double, 1, 1>(error), jacobian, matches.scale);
    }
  }

  double cost() const { return cost_; }
  Vector6d StepFor(double damping) const {
    Matrix6d damped = information_;
    damped.diagonal() *= 1 + damping;
    return -damped.ldlt().solve(gradient_);
  }

 private:
  void AddWithoutImage(double scale) {
    cost_ += std::log1p(kErrorWithoutImage * kErrorWithoutImage / (scale * scale));
  }
  template <int kRows>
  void Add(const Eigen::Matrix<double, kRows, 1>& error,
           const Eigen::Matrix<double, kRows, 6>& jacobian, double scale) {
    const double square = error.squaredNorm() / (scale * scale);
    const double weight = 1 / ((1 + square) * scale * scale);
    cost_ += std::log1p(square);
    information_.noalias() += weight * jacobian.transpose() * jacobian;
    gradient_.noalias() += weight * jacobian.transpose() * error;
  }

  double cost_ = 0;
  Vector6d gradient_ = Vector6d::Zero();
  Matrix6d information_ = Matrix6d::Zero();
};

}  // namespace

JointPose RefineJointly(const Rigid3& start, std::span<const Eigen::Vector2d> x,
                        std::span<const Eigen::Vector3d> points,
                        std::span<const PlacedMatches> neighbors, double scale) {
  const auto linearize = [&](const Rigid3& pose) {
    Linearized at_pose;
    for (size_t i = 0; i < x.size(); ++i) at_pose.AddPoint(pose, x[i], points[i], scale);
    for (const PlacedMatches& matches : neighbors) at_pose.AddMatches(pose, matches);
    return at_pose;
  };
  Rigid3 pose = start;
  Linearized here = linearize(pose);
  double damping = kDampingStart;
  for (int i = 0; i < kStepsMax && damping < kDampingMax; ++i) {
    const Vector6d step = here.StepFor(damping);
    if (!step.allFinite()) break;
    const Rigid3 next = Moved(pose, step);
    const Linearized there = linearize(next);
    if (!(there.cost() < here.cost())) {
      damping *= 10;
      continue;
    }
    const bool is_last = here.cost() - there.cost() < kCostShareMin * here.cost();
    pose = next;
    here = there;
    if (is_last) break;
    damping = std::max(kDampingMin, damping / 10);
  }
  return {pose, here.cost()};
}

}  // namespace veduta
