// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/pose_deviation.h"

#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/pose_covariance.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

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
  constexpr double kUndetermined = std::numeric_limits<double>::infinity();
  const std::vector<PointId> points = map.PointsSeenBy({&view, 1});
  if (points.empty()) return kUndetermined;
  const auto found = CovarianceOfPose(ProblemOf(map, view, points), BundleOptions().loss_scale_px);
  if (!found || !(found->error_px > 0)) return kUndetermined;
  // The covariance rests on errors of error_px along each axis.
  const double error_mrad = 1000 * found->error_px / map.image(view).camera.focal_px();
  const double of_1_mrad =
      std::sqrt(found->covariance.bottomRightCorner<3, 3>().trace()) / error_mrad;
  std::vector<double> depths;
  for (const PointId id : points)
    depths.push_back((map.image(view).cam_from_world * map.point(id).position).z());
  const double depth = MedianOf(std::move(depths));
  return depth > 0 && std::isfinite(of_1_mrad) ? of_1_mrad / depth : kUndetermined;
}

}  // namespace veduta
