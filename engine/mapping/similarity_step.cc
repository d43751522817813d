// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/similarity_step.h"

#include <Eigen/Dense>
#include <cmath>

#include "storage/base/cross_matrix.h"

namespace veduta {
namespace {

constexpr int kRefinementsMax = 15;  // as RefinePose; it stops where it moves no more

}  // namespace

Eigen::Matrix<double, 3, 7> SimilarityStep::MotionOf(const Eigen::Vector3d& x_b) {
  Eigen::Matrix<double, 3, 7> motion;
  motion << -CrossMatrix(x_b), Eigen::Matrix3d::Identity(), x_b;
  return motion;
}

Sim3 SimilarityStep::Moved(const Sim3& b_from_a, const Vector7& by) {
  const Eigen::Vector3d omega = by.head<3>();
  Sim3 motion{std::exp(by[6]), Eigen::Quaterniond::Identity(), by.segment<3>(3)};
  if (omega.norm() > 0)
    motion.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm(), omega.normalized()));
  return motion * b_from_a;
}

Sim3 SimilarityStep::Refine(const Sim3& start, double scale_px,
                            const std::function<void(SimilarityStep*)>& add) {
  Sim3 b_from_a = start;
  for (int i = 0; i < kRefinementsMax; ++i) {
    SimilarityStep step(b_from_a, scale_px);
    add(&step);
    const Vector7 by = step.Solve();
    if (!by.allFinite()) break;
    b_from_a = Moved(b_from_a, by);
    if (by.norm() < 1e-12 * (1 + b_from_a.translation.norm())) break;
  }
  return b_from_a;
}

void SimilarityStep::AddSightings(std::span<const CrossSighting> in_b,
                                  std::span<const CrossSighting> in_a) {
  for (const CrossSighting& seen : in_b) {
    const Eigen::Vector3d x_b = b_from_a_ * seen.point;
    Add(seen, seen.cam_from_world * x_b,
        seen.cam_from_world.rotation.toRotationMatrix() * MotionOf(x_b));
  }
  const Sim3 a_from_b = b_from_a_.Inverse();
  for (const CrossSighting& seen : in_a) {
    const Eigen::Matrix3d turn =
        (seen.cam_from_world.rotation * a_from_b.rotation).toRotationMatrix();
    Add(seen, seen.cam_from_world * (a_from_b * seen.point),
        -a_from_b.scale * turn * MotionOf(seen.point));
  }
}

void SimilarityStep::AddResidual(double residual_px, const Vector7& gradient) {
  const double weight = 1 / (1 + residual_px * residual_px / (scale_px_ * scale_px_));
  normal_ += weight * gradient * gradient.transpose();
  gradient_ += weight * gradient * residual_px;
}

void SimilarityStep::AddPrior(const Matrix7& information, const Vector7& from_mean) {
  normal_ += information;
  gradient_ += information * from_mean;
}

// A point at x_cam before the camera, which moves there by `motion`.
void SimilarityStep::Add(const CrossSighting& seen, const Eigen::Vector3d& x_cam,
                         const Eigen::Matrix<double, 3, 7>& motion) {
  if (!(x_cam.z() > 0)) return;
  const double z = x_cam.z();
  Eigen::Matrix<double, 2, 3> projection;
  projection << 1 / z, 0, -x_cam.x() / (z * z), 0, 1 / z, -x_cam.y() / (z * z);
  const Eigen::Vector2d error = seen.focal_px * (x_cam.hnormalized() - seen.x);
  const Eigen::Matrix<double, 2, 7> jacobian = seen.focal_px * projection * motion;
  const double weight = 1 / (1 + error.squaredNorm() / (scale_px_ * scale_px_));
  normal_ += weight * jacobian.transpose() * jacobian;
  gradient_ += weight * jacobian.transpose() * error;
}

SimilarityStep::Vector7 SimilarityStep::Solve() const {
  Matrix7 damped = normal_;
  damped.diagonal() *= 1 + 1e-9;
  return -damped.ldlt().solve(gradient_);
}

}  // namespace veduta
