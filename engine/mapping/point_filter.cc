// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/point_filter.h"

namespace veduta {

PointFilterCounts FilterPoints(Map* map, std::span<const PointId> points,
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
               TriangulationAngleDeg(map->ViewsOf(*point), point->position) <
                   options.angle_deg_min) {
      map->RemovePoint(id);
      ++counts.points_removed;
    }
  }
  return counts;
}

}  // namespace veduta
