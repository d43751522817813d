// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/planar_views.h"

#include <algorithm>
#include <map>

namespace veduta {

ImageUnits::ImageUnits(ImageSize size)
    : center_px((size.width_px - 1.0) / 2, (size.height_px - 1.0) / 2),
      unit_px(std::max({size.width_px, size.height_px, 1u})) {}

PlanarViews MakePlanarViews(const CalibrationInput& input) {
  PlanarViews made;
  if (input.views.empty()) return made;
  made.units = ImageUnits(input.views.front().size);
  for (const ViewObservations& view : input.views) {
    for (const PointObservation& point : view.points) made.point_ids.push_back(point.id);
  }
  std::sort(made.point_ids.begin(), made.point_ids.end());
  made.point_ids.erase(std::unique(made.point_ids.begin(), made.point_ids.end()),
                       made.point_ids.end());

  for (const ViewObservations& view : input.views) {
    std::map<uint32_t, std::vector<const PointObservation*>> of_id;
    for (const PointObservation& point : view.points) of_id[point.id].push_back(&point);
    PlanarView& planar = made.views.emplace_back();
    for (const auto& [id, seen] : of_id) {
      if (seen.size() != 1) continue;
      const auto at = std::lower_bound(made.point_ids.begin(), made.point_ids.end(), id);
      planar.push_back({static_cast<uint32_t>(at - made.point_ids.begin()),
                        made.units.FromPx(seen.front()->px),
                        seen.front()->sigma_px / made.units.unit_px});
    }
  }
  return made;
}

std::vector<std::pair<uint32_t, uint32_t>> CommonPoints(const PlanarView& a, const PlanarView& b) {
  std::vector<std::pair<uint32_t, uint32_t>> common;
  for (uint32_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (a[i].point == b[j].point) {
      common.emplace_back(i++, j++);
    } else if (a[i].point < b[j].point) {
      ++i;
    } else {
      ++j;
    }
  }
  return common;
}

}  // namespace veduta
