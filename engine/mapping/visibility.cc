// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/visibility.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/mapping/picture_cells.h"
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

// The feature of the view that the point's track has, if it has one.
std::optional<FeatureIndex> FindSeenBy(const PointRecord& point, ImageId view) {
  const auto own = std::ranges::find(point.track, view, &TrackElement::image);
  return own == point.track.end() ? std::nullopt : std::optional(own->feature);
}

VisibleStructure JudgeCells(const FoundCells& cells, const VisibilityOptions& options) {
  const FoundCells::Sums sums = cells.Judge(options.cell_points_min, options.cell_found_share_min);
  return {sums.expected, sums.found, sums.cells, sums.missing_cells};
}

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
      .AtLeast("depth_cells_each_way", depth_cells_each_way, 1)
      .Above("hidden_depth_ratio_min", hidden_depth_ratio_min, 1)
      .AtLeast("hidden_reach_cells", hidden_reach_cells, 1)
      .status();
}

std::vector<SeenDepth> ListSeenDepths(const CityMap& map, const MapImage& image) {
  std::vector<SeenDepth> seen;
  for (FeatureIndex feature = 0; feature < image.points.size(); ++feature) {
    const PointId id = image.points[feature];
    const PointRecord* const point = id.valid() ? map.FindPoint(id) : nullptr;
    if (point == nullptr) continue;
    const double depth = (image.cam_from_world * point->position).z();
    const Keypoint& keypoint = image.features->keypoints[feature];
    seen.push_back({{keypoint.x_px, keypoint.y_px}, depth});
  }
  return seen;
}

std::vector<ExpectedPoint> ListExpected(const CityMap& map, const MapImage& view,
                                        std::span<const SeenDepth> seen,
                                        std::span<const PointId> points,
                                        const VisibilityOptions& options) {
  std::vector<ExpectedPoint> expected;
  NearDepths near({view.width_px, view.height_px, options.depth_cells_each_way},
                  options.hidden_reach_cells);
  for (const SeenDepth& one : seen) near.Note(one.x_px, one.depth);
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
    if (const std::optional<FeatureIndex> own = FindSeenBy(*point, view.id)) {
      expected.push_back({id, x_px, own});
      continue;
    }
    if (x_cam.z() > options.hidden_depth_ratio_min * near.At(x_px)) continue;
    const Features& known = *map.image(alike->image).features;
    const auto found = FindNear(
        *view.grid, *view.features,
        {x_px.x(), x_px.y(), options.search_radius_px, known.descriptor(alike->feature),
         known.keypoints[alike->feature].contrast_sign, options.descriptor_distance_squared_max},
        &scratch);
    expected.push_back({id, x_px, found ? std::optional(found->feature) : std::nullopt});
  }
  return expected;
}

VisibleStructure FindVisible(const CityMap& map, const MapImage& view,
                             std::span<const SeenDepth> seen, std::span<const PointId> points,
                             const VisibilityOptions& options) {
  FoundCells cells({view.width_px, view.height_px, options.cells_each_way});
  for (const ExpectedPoint& point : ListExpected(map, view, seen, points, options))
    cells.Note(point.x_px, point.found.has_value());
  return JudgeCells(cells, options);
}

std::vector<VisibleStructure> FindVisibleOfEach(const CityMap& map, const MapImage& view,
                                                std::span<const SeenDepth> seen,
                                                std::span<const PointId> points,
                                                std::span<const ImageId> images,
                                                const VisibilityOptions& options) {
  const PictureGrid grid{view.width_px, view.height_px, options.cells_each_way};
  std::vector<FoundCells> cells(images.size(), FoundCells(grid));
  for (const ExpectedPoint& point : ListExpected(map, view, seen, points, options)) {
    for (const TrackElement& element : map.point(point.point).track) {
      const auto at = std::ranges::lower_bound(images, element.image);
      if (at != images.end() && *at == element.image)
        cells[static_cast<size_t>(at - images.begin())].Note(point.x_px, point.found.has_value());
    }
  }
  std::vector<VisibleStructure> visible;
  for (const FoundCells& of_image : cells) visible.push_back(JudgeCells(of_image, options));
  return visible;
}

}  // namespace veduta
