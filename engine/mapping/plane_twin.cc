// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/plane_twin.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "storage/base/median.h"

namespace veduta {

std::optional<Eigen::Vector3d> FitPlane(std::span<const Eigen::Vector3d> points) {
  constexpr int kRounds = 10;  // of weights; chosen by hand, not measured
  if (points.size() < 3) return std::nullopt;
  // n . X = 1 is linear in n. The weights are those of Cauchy's loss at the median error.
  std::vector<double> weights(points.size(), 1.0), errors(points.size());
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d x = points[i] / points[i].z();
      normal += weights[i] * x * x.transpose();
      right += weights[i] / points[i].z() * x;
    }
    const Eigen::FullPivLU<Eigen::Matrix3d> solver(normal);
    if (!solver.isInvertible()) return std::nullopt;
    plane = solver.solve(right);
    if (!plane.allFinite()) return std::nullopt;
    for (size_t i = 0; i < points.size(); ++i) errors[i] = std::abs(plane.dot(points[i]) - 1);
    const double scale = std::max(MedianOf(errors), 1e-9);
    for (size_t i = 0; i < points.size(); ++i)
      weights[i] = 1 / (1 + errors[i] * errors[i] / (scale * scale));
  }
  return plane;
}

std::optional<Rigid3> PlaneTwin(const Rigid3& b_from_a, const Eigen::Vector3d& plane,
                                const Eigen::Vector3d& ray) {
  constexpr double kSame = 1e-4;  // radians and shares: less is no other pose
  // The homography of the plane; its middle singular value is 1.
  const Eigen::Matrix3d rotation = b_from_a.rotation.toRotationMatrix();
  const Eigen::Matrix3d h = rotation + b_from_a.translation * plane.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> squared(h.transpose() * h);
  const double least = squared.eigenvalues()[0], most = squared.eigenvalues()[2];
  if (!(most - least > kSame) || !(h.determinant() > 0)) return std::nullopt;
  const double p = std::sqrt(std::max(0.0, 1 - least) / (most - least)),
               q = std::sqrt(std::max(0.0, most - 1) / (most - least));
  const Eigen::Vector3d v2 = squared.eigenvectors().col(1);
  std::optional<Rigid3> twin;
  double largest = kSame;
  for (const double sign : {1.0, -1.0}) {
    // A direction in the plane whose length the homography keeps, as it does that of v2.
    const Eigen::Vector3d u =
        p * squared.eigenvectors().col(2) + sign * q * squared.eigenvectors().col(0);
    Eigen::Matrix3d from, to;
    from << v2, u, v2.cross(u);
    to << h * v2, h * u, (h * v2).cross(h * u);
    const Eigen::Matrix3d candidate = to * from.transpose();
    const double angle = Eigen::AngleAxisd(candidate * rotation.transpose()).angle();
    if (angle <= largest) continue;
    Eigen::Vector3d n = v2.cross(u);
    if (n.dot(ray) < 0) n = -n;  // what a camera sees lies before it
    const Eigen::Vector3d translation = (h - candidate) * n;
    if (!(translation.norm() > 0)) continue;
    largest = angle;
    twin = Rigid3{Eigen::Quaterniond(candidate).normalized(), translation.normalized()};
  }
  return twin;
}

}  // namespace veduta
