// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/point_filter.h"

#include <cmath>

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Between the sizes in the world of what two images see there, by their features' scales; octaves.
double SizeDifference(const CityMap& map, const PointRecord& point) {
  const auto size = [&](const TrackElement& element) {
    const MapImage& image = map.image(element.image);
    const double depth = (image.cam_from_world * point.position).z();
    return image.features->keypoints[element.feature].scale_px * depth / image.camera.fx;
  };
  return std::abs(std::log2(size(point.track.front()) / size(point.track.back())));
}

bool IsWrong(const CityMap& map, const PointRecord& point, const PointFilterOptions& options) {
  return point.error_px > options.point_error_px_max ||
         !HasAngle(map.ViewsOf(point), point.position, options.angle_deg_min) ||
         (point.track.size() == 2 && SizeDifference(map, point) > options.size_octaves_max);
}

}  // namespace

Status PointFilterOptions::Check() const {
  return OptionBounds()
      .Above("observation_error_px_max", observation_error_px_max, 0)
      .Above("point_error_px_max", point_error_px_max, 0)
      .Require("angle_deg_min", angle_deg_min, angle_deg_min >= 0 && angle_deg_min < 90,
               "0 or more and less than 90")
      .Above("size_octaves_max", size_octaves_max, 0)
      .status();
}

PointFilterCounts FilterPoints(CityMap* map, std::span<const PointId> points,
                               const PointFilterOptions& options) {
  PointFilterCounts counts;
  for (const PointId id : points) {
    if (map->FindPoint(id) == nullptr) continue;
    const std::vector<TrackElement> track = map->point(id).track;
    for (const TrackElement& element : track) {
      const PointRecord* point = map->FindPoint(id);
      if (point == nullptr) break;
      const Sighting view = map->image(element.image).ViewOf(element.feature);
      if (ReprojectionErrorPx(view, point->position) <= options.observation_error_px_max) continue;
      map->RemoveObservation(id, element.image);
      ++counts.observations_removed;
    }
    const PointRecord* point = map->FindPoint(id);
    if (point == nullptr) {
      ++counts.points_removed;
    } else if (IsWrong(*map, *point, options)) {
      map->RemovePoint(id);
      ++counts.points_removed;
    }
  }
  return counts;
}

}  // namespace veduta
