// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/agreeing_growth.h"

#include <algorithm>

#include "engine/mapping/resection.h"
#include "engine/matching/two_view.h"

namespace veduta {
namespace {

// A pose has six degrees of freedom and a point gives two equations, so 3 points determine it;
// twice as many let one of them be wrong. Chosen by hand; not measured.
constexpr size_t kRefinedPointsMin = 6;

void RefineByPoints(CityMap* map, ImageId id, double error_px_max) {
  const MapImage& image = map->image(id);
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (FeatureIndex f = 0; f < image.points.size(); ++f) {
    const PointRecord* point = image.points[f].valid() ? map->FindPoint(image.points[f]) : nullptr;
    if (point == nullptr) continue;
    x.push_back(image.camera.Normalize(image.features->keypoints[f]));
    points.push_back(point->position);
  }
  if (x.size() < kRefinedPointsMin) return;
  map->SetPose(id, RefinePose(image.cam_from_world, x, points,
                              0.5 * error_px_max / image.camera.focal_px()));
}

}  // namespace

std::vector<PairMatches> KeepAgreeing(const CityMap& map, ImageId id,
                                      std::span<const PairMatches> putative, double error_px_max) {
  const MapImage& image = map.image(id);
  std::vector<PairMatches> agreeing;
  for (const PairMatches& pair : putative) {
    const MapImage& other = map.image(pair.other);
    if (other.reconstruction != image.reconstruction) continue;
    const Eigen::Matrix3d essential =
        EssentialFromPose(other.cam_from_world * image.cam_from_world.Inverse());
    const double distance_max =
        error_px_max / std::min(image.camera.focal_px(), other.camera.focal_px());
    agreeing.push_back({pair.other, pair.geometry, pair.other_from_photo, {}, {}, {}});
    for (const FeatureMatch& m : pair.matches) {
      const Eigen::Vector2d x = image.camera.Normalize(image.features->keypoints[m.a]);
      const Eigen::Vector2d x_other = other.camera.Normalize(other.features->keypoints[m.b]);
      if (SampsonDistance(essential, x, x_other) < distance_max)
        agreeing.back().matches.push_back(m);
    }
  }
  return agreeing;
}

void GrowFromAgreeing(CityMap* map, ImageId image, std::span<const PairMatches> putative,
                      const GrowthOptions& options) {
  const auto agreeing = KeepAgreeing(*map, image, putative, options.error_px_max);
  GrowFromMatches(map, image, agreeing, options);
}

void GrowAndRefine(CityMap* map, ImageId image, std::span<const PairMatches> putative,
                   const GrowthOptions& options) {
  GrowFromAgreeing(map, image, putative, options);
  RefineByPoints(map, image, options.error_px_max);
}

}  // namespace veduta
