// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/resection.h"

#include <Eigen/Dense>
#include <cmath>
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>

#include "engine/matching/sampling.h"
#include "storage/base/option_bounds.h"
#include "storage/base/transform.h"

namespace veduta {
namespace {

// Enough to find, with a confidence of 1 - 1e-3, a pose that a fifth of the correspondences agrees
// with (Fischler and Bolles 1981, samples of 3).
constexpr uint32_t kRivalSamplesMax = 1000;

bool IsInlier(const Eigen::Matrix3d& r, const Eigen::Vector3d& t, const Eigen::Vector2d& x,
              const Eigen::Vector3d& point, double error_squared_max) {
  const Eigen::Vector3d p = r * point + t;
  return p.z() > 0 && (p.head<2>() - p.z() * x).squaredNorm() < error_squared_max * p.z() * p.z();
}

std::vector<uint32_t> FindInliers(const Rigid3& pose, std::span<const Eigen::Vector2d> x,
                                  std::span<const Eigen::Vector3d> points, double error_max) {
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  std::vector<uint32_t> inliers;
  for (uint32_t i = 0; i < x.size(); ++i) {
    if (IsInlier(r, pose.translation, x[i], points[i], error_max * error_max)) inliers.push_back(i);
  }
  return inliers;
}

// The pose that most of the correspondences agree with, and how many do.
uint32_t SearchPose(std::span<const Eigen::Vector2d> x, std::span<const Eigen::Vector3d> points,
                    double error_max, uint64_t seed, const ResectionOptions& options,
                    Rigid3* best_pose) {
  const uint32_t n = static_cast<uint32_t>(x.size());
  opengv::bearingVectors_t rays(n);
  opengv::points_t world(n);
  for (uint32_t i = 0; i < n; ++i) {
    rays[i] = x[i].homogeneous().normalized();
    world[i] = points[i];
  }
  const opengv::absolute_pose::CentralAbsoluteAdapter adapter(rays, world);
  SeededRandom random(seed);
  std::vector<int> sample(3);
  uint32_t best = 0, samples_needed = options.samples_max;
  for (uint32_t t = 0; t < samples_needed; ++t) {
    DrawDistinct(random, FrontCount(n, t, 20), sample);
    for (const opengv::transformation_t& world_from_cam :
         opengv::absolute_pose::p3p_kneip(adapter, sample)) {
      if (!world_from_cam.allFinite()) continue;
      const Eigen::Matrix3d r = world_from_cam.leftCols<3>().transpose();
      const Eigen::Vector3d translation = -r * world_from_cam.col(3);
      uint32_t inliers = 0;
      for (uint32_t i = 0; i < n && inliers + (n - i) > best; ++i) {
        inliers += IsInlier(r, translation, x[i], points[i], error_max * error_max);
      }
      if (inliers > best) {
        best = inliers;
        *best_pose = {Eigen::Quaterniond(r).normalized(), translation};
        samples_needed =
            std::min(options.samples_max,
                     std::max(20u, SamplesNeeded(options.confidence, inliers / double(n), 3)));
      }
    }
  }
  return best;
}

// Refines a first pose on what agrees with it, and judges what comes out.
Resection FinishResection(Rigid3 pose, std::span<const Eigen::Vector2d> x,
                          std::span<const Eigen::Vector3d> points, double focal_px,
                          const ResectionOptions& options) {
  const double error_max = options.error_px_max / focal_px;
  for (int round = 0; round < 3; ++round) {
    std::vector<Eigen::Vector2d> in_x;
    std::vector<Eigen::Vector3d> in_points;
    for (const uint32_t i : FindInliers(pose, x, points, (round == 0 ? 2.0 : 1.0) * error_max)) {
      in_x.push_back(x[i]);
      in_points.push_back(points[i]);
    }
    if (in_x.size() < 4) return {ResectionOutcome::kTooFewInliers, {}, {}};
    pose = RefinePose(pose, in_x, in_points, 0.3 * error_max);
  }
  return JudgePose(pose, x, points, focal_px, options);
}

}  // namespace

Status ResectionOptions::Check() const {
  return OptionBounds()
      .Inside("error_px_max", error_px_max, 0, 100)
      .AtLeast("inlier_count_min", inlier_count_min, 4)
      .Between("inlier_share_min", inlier_share_min, 0, 1)
      .Inside("confidence", confidence, 0, 1)
      .AtLeast("samples_max", samples_max, 1)
      .Above("rival_error_px_min", rival_error_px_min, 0)
      .Between("rival_share_max", rival_share_max, 0, 1)
      .status();
}

Rigid3 RefinePose(const Rigid3& start, std::span<const Eigen::Vector2d> x,
                  std::span<const Eigen::Vector3d> points, double scale) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Rigid3 pose = start;
  for (int iteration = 0; iteration < 15; ++iteration) {
    const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 gradient = Vector6::Zero();
    for (size_t i = 0; i < x.size(); ++i) {
      const Eigen::Vector3d rotated = r * points[i], p = rotated + pose.translation;
      if (!(p.z() > 0)) continue;
      const Eigen::Vector2d residual = p.hnormalized() - x[i];
      const double weight = 1.0 / (1.0 + residual.squaredNorm() / (scale * scale));
      Eigen::Matrix<double, 2, 3> projection;
      projection << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
      Eigen::Matrix<double, 3, 6> motion;  // rotation about the camera's axes, then translation
      motion << 0, rotated.z(), -rotated.y(), 1, 0, 0, -rotated.z(), 0, rotated.x(), 0, 1, 0,
          rotated.y(), -rotated.x(), 0, 0, 0, 1;
      const Eigen::Matrix<double, 2, 6> jacobian = projection * motion;
      normal += weight * jacobian.transpose() * jacobian;
      gradient += weight * jacobian.transpose() * residual;
    }
    normal.diagonal() *= 1 + 1e-9;
    const Vector6 step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) break;
    const Eigen::Vector3d omega = step.head<3>();
    if (omega.norm() > 0) {
      pose.rotation =
          (Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm(), omega.normalized())) * pose.rotation)
              .normalized();
    }
    pose.translation += step.tail<3>();
    if (step.norm() < 1e-12 * (1 + pose.translation.norm())) break;
  }
  return pose;
}

Resection Resect(std::span<const Eigen::Vector2d> x, std::span<const Eigen::Vector3d> points,
                 double focal_px, uint64_t seed, const ResectionOptions& options) {
  Resection result;
  if (x.size() < options.inlier_count_min || x.size() != points.size()) return result;
  result.outcome = ResectionOutcome::kTooFewInliers;
  const double error_max = options.error_px_max / focal_px;
  Rigid3 pose;
  if (SearchPose(x, points, error_max, seed, options, &pose) <
      std::max(4u, options.inlier_count_min / 2))
    return result;
  return FinishResection(pose, x, points, focal_px, options);
}

Resection ResectAlong(const Rigid3& cam_from_neighbor, const Rigid3& neighbor_from_world,
                      std::span<const Eigen::Vector2d> x, std::span<const Eigen::Vector3d> points,
                      double focal_px, const ResectionOptions& options) {
  Resection result;
  if (x.size() < options.inlier_count_min || x.size() != points.size()) return result;
  result.outcome = ResectionOutcome::kTooFewInliers;
  const double error_max = options.error_px_max / focal_px;
  const Rigid3 turned{cam_from_neighbor.rotation * neighbor_from_world.rotation,
                      cam_from_neighbor.rotation * neighbor_from_world.translation};
  const Eigen::Vector3d& t = cam_from_neighbor.translation;
  const auto at_baseline = [&](double length) {
    return Rigid3{turned.rotation, turned.translation + length * t};
  };
  size_t best = 0;
  Rigid3 pose;
  for (size_t i = 0; i < x.size(); ++i) {
    // The point projects to x where its image along the baseline, a line, comes nearest.
    const Eigen::Vector3d p = turned * points[i];
    const Eigen::Vector2d a = p.head<2>() - p.z() * x[i], b = t.head<2>() - t.z() * x[i];
    const double length = -a.dot(b) / b.squaredNorm();
    if (!(length > 0) || !std::isfinite(length)) continue;
    const size_t inliers = FindInliers(at_baseline(length), x, points, error_max).size();
    if (inliers > best) {
      best = inliers;
      pose = at_baseline(length);
    }
  }
  return best < 4 ? result : FinishResection(pose, x, points, focal_px, options);
}

Resection JudgePose(const Rigid3& pose, std::span<const Eigen::Vector2d> x,
                    std::span<const Eigen::Vector3d> points, double focal_px,
                    const ResectionOptions& options) {
  Resection result;
  result.cam_from_world = pose;
  result.inliers = FindInliers(pose, x, points, options.error_px_max / focal_px);
  const bool is_enough = result.inliers.size() >= options.inlier_count_min &&
                         static_cast<double>(result.inliers.size()) >=
                             options.inlier_share_min * static_cast<double>(x.size());
  result.outcome = is_enough ? ResectionOutcome::kPlaced : ResectionOutcome::kTooFewInliers;
  return result;
}

std::vector<uint32_t> ListRivals(const Rigid3& cam_from_world, std::span<const Eigen::Vector2d> x,
                                 std::span<const Eigen::Vector3d> points, double focal_px,
                                 const ResectionOptions& options) {
  const double distance_min = options.rival_error_px_min / focal_px;
  std::vector<uint32_t> rivals;
  for (uint32_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d x_cam = cam_from_world * points[i];
    if (x_cam.z() <= 0 || (x_cam.hnormalized() - x[i]).norm() >= distance_min) rivals.push_back(i);
  }
  return rivals;
}

uint32_t CountRivalInliers(std::span<const Eigen::Vector2d> x,
                           std::span<const Eigen::Vector3d> points, double focal_px,
                           const Resection& found, uint64_t seed, const ResectionOptions& options) {
  std::vector<Eigen::Vector2d> other_x;
  std::vector<Eigen::Vector3d> other_points;
  for (const uint32_t i : ListRivals(found.cam_from_world, x, points, focal_px, options)) {
    other_x.push_back(x[i]);
    other_points.push_back(points[i]);
  }
  ResectionOptions rival_options = options;
  rival_options.inlier_share_min = 0;
  rival_options.samples_max = std::min(options.samples_max, kRivalSamplesMax);
  const Resection rival = Resect(other_x, other_points, focal_px, seed, rival_options);
  return rival.outcome == ResectionOutcome::kPlaced ? static_cast<uint32_t>(rival.inliers.size())
                                                    : 0;
}

}  // namespace veduta
