// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/pose_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace veduta {
namespace {

using Matrix26d = Eigen::Matrix<double, 2, 6>;

// Eigenvalue of the information, scaled to a diagonal of ones, below which a direction of the pose
// is not determined: far above the rounding of sums of doubles, and far below any pose that was
// adjusted. Chosen by hand; not measured.
constexpr double kEigenvalueMin = 1e-12;

Eigen::Matrix3d Cross(const Eigen::Vector3d& x) {
  Eigen::Matrix3d matrix;
  matrix << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
  return matrix;
}

// The sums over all points.
struct Sums {
  // J'J of the pose, the points eliminated: with the points' weights, and with their squares.
  Matrix6d weighted = Matrix6d::Zero(), weighted_twice = Matrix6d::Zero();
  double squares = 0;                          // of |psi|^2
  double curvature = 0, curvature_square = 0;  // of w^2, and of w^4
  size_t observations = 0, points = 0;
};

// Adds point `index`, unless what is seen of it does not determine it.
void AddPoint(const BundleProblem& problem, uint32_t index, const BundleOptions& options,
              Sums* sums) {
  Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
  Matrix6d pose = Matrix6d::Zero();
  Eigen::Matrix<double, 6, 3> coupling = Eigen::Matrix<double, 6, 3>::Zero();
  double squares = 0, curvature = 0, curvature_square = 0;
  size_t observations = 0;
  for (uint32_t o = problem.first_observation[index]; o < problem.first_observation[index + 1];
       ++o) {
    const BundleObservation& seen = problem.observations[o];
    const Rigid3& cam_from_world = problem.cams_from_world[seen.image];
    const Eigen::Vector3d x_cam = cam_from_world * problem.points[index];
    Matrix23d by_cam;
    const Eigen::Vector2d error =
        ReprojectionError(problem.cameras[seen.image], x_cam, seen.x_px, &by_cam);
    if (by_cam.isZero(0)) continue;  // behind the camera
    const double square = error.squaredNorm();
    const double weight = 1 / (1 + square / (options.loss_scale_px * options.loss_scale_px));
    const Eigen::Matrix3d rotation = cam_from_world.rotation.toRotationMatrix();
    const Eigen::Matrix<double, 2, 3> by_point = by_cam * rotation;
    ++observations;
    squares += weight * weight * square;
    curvature += weight * weight;
    curvature_square += std::pow(weight, 4);
    own.noalias() += weight * weight * by_point.transpose() * by_point;
    if (seen.image != 0) continue;
    Matrix26d by_pose;  // x_cam = R (X - c) changes by omega x x_cam - R d
    by_pose << -by_cam * Cross(x_cam), -by_point;
    pose.noalias() += weight * weight * by_pose.transpose() * by_pose;
    coupling.noalias() += weight * weight * by_pose.transpose() * by_point;
  }
  Eigen::Matrix3d inverse;
  bool is_invertible = false;
  own.computeInverseWithCheck(inverse, is_invertible, 0);
  if (!is_invertible || !inverse.allFinite()) return;
  const double of_point = PointWeight(problem, index, options);
  const Matrix6d of_pose = pose - coupling * inverse * coupling.transpose();
  sums->weighted += of_point * of_pose;
  sums->weighted_twice += of_point * of_point * of_pose;
  sums->squares += squares;
  sums->curvature += curvature;
  sums->curvature_square += curvature_square;
  sums->observations += observations;
  ++sums->points;
}

}  // namespace

std::optional<PoseCovariance> CovarianceOfPose(const BundleProblem& problem,
                                               const BundleOptions& options) {
  Sums sums;
  for (uint32_t i = 0; i < problem.points.size(); ++i) AddPoint(problem, i, options, &sums);
  const double observed = 2 * static_cast<double>(sums.observations);
  const double estimated = 6 + 3 * static_cast<double>(sums.points);
  const double redundancy = observed - estimated;
  if (!(redundancy > 0) || !(sums.curvature > 0)) return std::nullopt;
  // Radians and world units differ by orders of magnitude: invert with a diagonal of ones.
  const Vector6d diagonal = sums.weighted.diagonal();
  if (!diagonal.allFinite() || !(diagonal.minCoeff() > 0)) return std::nullopt;
  const Vector6d scale = diagonal.cwiseSqrt().cwiseInverse();
  const Matrix6d scaled = scale.asDiagonal() * sums.weighted * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scaled, Eigen::EigenvaluesOnly);
  if (!(solver.eigenvalues()[0] > kEigenvalueMin)) return std::nullopt;
  const Matrix6d inverse =
      scale.asDiagonal() * scaled.llt().solve(Matrix6d::Identity()) * scale.asDiagonal();
  const Matrix6d spread_of_pose = inverse * sums.weighted_twice * inverse.transpose();
  const double curvature = 2 * sums.curvature / observed;
  const double spread = 2 * sums.curvature_square / observed - curvature * curvature;
  const double correction = 1 + estimated / observed * spread / (curvature * curvature);
  const double variance = sums.squares / redundancy;
  PoseCovariance result;
  result.covariance =
      correction * variance / curvature * 0.5 * (spread_of_pose + spread_of_pose.transpose());
  result.error_px = std::sqrt(variance) / curvature;
  return result;
}

}  // namespace veduta
