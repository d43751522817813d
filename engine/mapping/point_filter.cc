// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/point_filter.h"

#include "storage/base/option_bounds.h"

namespace veduta {

Status PointFilterOptions::Check() const {
  return OptionBounds()
      .Above("observation_error_px_max", observation_error_px_max, 0)
      .Above("point_error_px_max", point_error_px_max, 0)
      .Require("angle_deg_min", angle_deg_min, angle_deg_min >= 0 && angle_deg_min < 90,
               "0 or more and less than 90")
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
    } else if (point->error_px > options.point_error_px_max ||
               !HasAngle(map->ViewsOf(*point), point->position, options.angle_deg_min)) {
      map->RemovePoint(id);
      ++counts.points_removed;
    }
  }
  return counts;
}

}  // namespace veduta
