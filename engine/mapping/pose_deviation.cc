// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/pose_deviation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/network_covariance.h"
#include "engine/mapping/pose_covariance.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

// Reciprocal condition below which points do not determine a pose: far above the rounding of sums
// of doubles. Chosen by hand; not measured.
constexpr double kReciprocalConditionMin = 1e-13;

constexpr double kUndetermined = std::numeric_limits<double>::infinity();

double MedianDepth(const CityMap& map, ImageId view, std::span<const PointId> points) {
  std::vector<double> depths;
  for (const PointId id : points)
    depths.push_back((map.image(view).cam_from_world * map.point(id).position).z());
  return MedianOf(std::move(depths), 0.0);
}

// The images of a problem, in the order in which they were first asked for.
class Images final {
 public:
  Images(const CityMap& map, BundleProblem* problem) : map_(map), problem_(problem) {}

  uint32_t PlaceOf(ImageId id) {
    const auto [place, is_new] =
        places_.try_emplace(id, static_cast<uint32_t>(problem_->cams_from_world.size()));
    if (is_new) {
      problem_->cams_from_world.push_back(map_.image(id).cam_from_world);
      problem_->cameras.push_back(map_.image(id).camera);
    }
    return place->second;
  }

 private:
  const CityMap& map_;
  BundleProblem* problem_;
  std::map<ImageId, uint32_t> places_;
};

// The view is the first pose, the free one.
BundleProblem ProblemOf(const CityMap& map, ImageId view, std::span<const PointId> points) {
  BundleProblem problem;
  problem.free_count = 1;
  Images images(map, &problem);
  images.PlaceOf(view);
  for (const PointId id : points) {
    const PointRecord& point = map.point(id);
    problem.points.push_back(point.position);
    problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
    for (const TrackElement& element : point.track) {
      if (!map.HasImage(element.image)) continue;
      const Keypoint& keypoint = map.image(element.image).features->keypoints[element.feature];
      problem.observations.push_back(
          {images.PlaceOf(element.image), {keypoint.x_px, keypoint.y_px}});
    }
  }
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  return problem;
}

}  // namespace

double DeviationShare(const CityMap& map, ImageId view) {
  const std::vector<PointId> points = map.PointsSeenBy({&view, 1});
  if (points.empty()) return kUndetermined;
  // What the view sees is asked here, not what adjustment makes of it: each point counts alike.
  // With its weights more poses were refused, and of 72 orders of a street 49 ended in one
  // reconstruction where it is 56.
  const BundleOptions alike{.two_view_weight = 1};
  const auto found = CovarianceOfPose(ProblemOf(map, view, points), alike);
  if (!found || !(found->error_px > 0)) return kUndetermined;
  // The covariance rests on errors of error_px along each axis.
  const double error_mrad = 1000 * found->error_px / map.image(view).camera.focal_px();
  const double of_1_mrad =
      std::sqrt(found->covariance.bottomRightCorner<3, 3>().trace()) / error_mrad;
  const double depth = MedianDepth(map, view, points);
  return depth > 0 && std::isfinite(of_1_mrad) ? of_1_mrad / depth : kUndetermined;
}

double DeviationShareInNetwork(const CityMap& map, ImageId view, uint32_t neighbors_max) {
  const auto found =
      CovarianceInNetwork(NetworkProblem(map, view, neighbors_max), BundleOptions().loss_scale_px);
  const double depth = MedianDepth(map, view, map.PointsSeenBy({&view, 1}));
  if (!found || !(depth > 0)) return kUndetermined;
  return std::sqrt(found->covariance.bottomRightCorner<3, 3>().trace()) / depth;
}

double DeviationShare(const Rigid3& cam_from_world, std::span<const Eigen::Vector3d> points) {
  // By a turn and a move of the camera, both along its own axes, the move in median depths.
  Matrix6d information = Matrix6d::Zero();
  std::vector<double> depths;
  for (const Eigen::Vector3d& point : points) depths.push_back((cam_from_world * point).z());
  const double depth = MedianOf(std::move(depths), 0.0);
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = cam_from_world * point;
    if (!(p.z() > 0)) continue;
    Eigen::Matrix<double, 2, 3> projection;
    projection << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
    Eigen::Matrix<double, 3, 6> motion;
    motion << 0, p.z(), -p.y(), -depth, 0, 0, -p.z(), 0, p.x(), 0, -depth, 0, p.y(), -p.x(), 0, 0,
        0, -depth;
    const Eigen::Matrix<double, 2, 6> jacobian = projection * motion;
    information.noalias() += jacobian.transpose() * jacobian;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(information);
  const Vector6d& values = solver.eigenvalues();  // ascending
  if (!(depth > 0) || !(values[0] > kReciprocalConditionMin * values[5])) return kUndetermined;
  const Matrix6d inverse = information.ldlt().solve(Matrix6d::Identity());
  return 1e-3 * std::sqrt(inverse.bottomRightCorner<3, 3>().trace());
}

}  // namespace veduta
