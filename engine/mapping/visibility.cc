// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/visibility.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/matching/guided_matcher.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// The element of the track whose view of the point is most like the one from `center`, or null
// where none is alike, or where fewer than two other images see the point.
const TrackElement* FindAlike(const CityMap& map, const PointRecord& point, ImageId view,
                              const Eigen::Vector3d& center, const VisibilityOptions& options) {
  NearestDirection nearest(center, point.position);
  const TrackElement* best = nullptr;
  uint32_t others = 0;
  const double distance = (point.position - center).norm();
  for (const TrackElement& element : point.track) {
    if (element.image == view) continue;
    ++others;
    const Eigen::Vector3d other = map.image(element.image).cam_from_world.Center();
    const double ratio = distance / (point.position - other).norm();
    if (!(ratio < options.distance_ratio_max && ratio * options.distance_ratio_max > 1)) continue;
    if (nearest.IsNearer(other)) best = &element;
  }
  return others >= 2 && nearest.angle_deg() < options.angle_deg_max ? best : nullptr;
}

bool IsSeenBy(const PointRecord& point, ImageId view) {
  return std::any_of(point.track.begin(), point.track.end(),
                     [&](const TrackElement& e) { return e.image == view; });
}

// Expected and found points of each cell.
class Cells {
 public:
  Cells(const MapImage& view, uint32_t each_way)
      : view_(view),
        each_way_(each_way),
        expected_(each_way * each_way),
        found_(expected_.size()) {}

  void Note(const Eigen::Vector2d& x_px, bool is_found) {
    const auto at = [&](double x, uint32_t size) {
      return std::min(static_cast<uint32_t>(x / size * each_way_), each_way_ - 1);
    };
    const size_t cell = at(x_px.y(), view_.height_px) * each_way_ + at(x_px.x(), view_.width_px);
    ++expected_[cell];
    found_[cell] += is_found;
  }

  VisibleStructure Judge(const VisibilityOptions& options) const {
    VisibleStructure visible;
    for (size_t i = 0; i < expected_.size(); ++i) {
      visible.expected += expected_[i];
      visible.found += found_[i];
      if (expected_[i] < options.cell_points_min) continue;
      ++visible.cells;
      visible.missing_cells += found_[i] < options.cell_found_share_min * expected_[i];
    }
    return visible;
  }

 private:
  const MapImage& view_;
  const uint32_t each_way_;
  std::vector<uint32_t> expected_, found_;
};

}  // namespace

Status VisibilityOptions::Check() const {
  return OptionBounds()
      .Inside("angle_deg_max", angle_deg_max, 0, 90)
      .Above("distance_ratio_max", distance_ratio_max, 1)
      .Above("search_radius_px", search_radius_px, 0)
      .AtLeast("descriptor_distance_squared_max", descriptor_distance_squared_max, 1)
      .AtLeast("cells_each_way", cells_each_way, 1)
      .AtLeast("cell_points_min", cell_points_min, 1)
      .Between("cell_found_share_min", cell_found_share_min, 0, 1)
      .status();
}

VisibleStructure FindVisible(const CityMap& map, const MapImage& view,
                             std::span<const PointId> points, const VisibilityOptions& options) {
  Cells cells(view, options.cells_each_way);
  GuidedScratch scratch;
  const Eigen::Vector3d center = view.cam_from_world.Center();
  const double border_px = options.search_radius_px;
  for (const PointId id : points) {
    const PointRecord* point = map.FindPoint(id);
    if (point == nullptr) continue;
    const Eigen::Vector3d x_cam = view.cam_from_world * point->position;
    if (!(x_cam.z() > 0)) continue;
    const Eigen::Vector2d x_px = view.camera.Project(x_cam);
    if (!(x_px.x() >= border_px && x_px.y() >= border_px && x_px.x() < view.width_px - border_px &&
          x_px.y() < view.height_px - border_px))
      continue;
    const TrackElement* alike = FindAlike(map, *point, view.id, center, options);
    if (alike == nullptr) continue;
    if (IsSeenBy(*point, view.id)) {
      cells.Note(x_px, true);
      continue;
    }
    const Features& known = *map.image(alike->image).features;
    const auto found = FindNear(
        *view.grid, *view.features,
        {x_px.x(), x_px.y(), options.search_radius_px, known.descriptor(alike->feature),
         known.keypoints[alike->feature].contrast_sign, options.descriptor_distance_squared_max},
        &scratch);
    cells.Note(x_px, found.has_value());
  }
  return cells.Judge(options);
}

}  // namespace veduta
