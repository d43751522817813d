// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/visibility.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/matching/guided_matcher.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Points near by that say how far away what a view sees is. Chosen by hand; not measured.
constexpr size_t kNearPointsMin = 3;

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

// The cell of a picture of `size` px that x lies in, one way.
uint32_t CellOf(double x, uint32_t size, uint32_t each_way) {
  return std::min(static_cast<uint32_t>(std::max(x, 0.0) / size * each_way), each_way - 1);
}

// How far away what the view sees is, in each part of the picture.
class NearDepths {
 public:
  NearDepths(const MapImage& view, std::span<const SeenDepth> seen, uint32_t each_way,
             uint32_t reach)
      : view_(view),
        reach_(reach),
        each_way_(each_way),
        depths_(each_way * each_way),
        medians_(each_way * each_way, kUnknown) {
    for (const SeenDepth& one : seen)
      depths_[Row(one.x_px) * each_way_ + Column(one.x_px)].push_back(one.depth);
  }

  // The median of the cell and of those around it, as far around as it takes to know; infinite
  // where the view sees nothing.
  double At(const Eigen::Vector2d& x_px) {
    const uint32_t row = Row(x_px), column = Column(x_px);
    double& median = medians_[row * each_way_ + column];
    if (median == kUnknown) median = FindMedian(row, column);
    return median;
  }

 private:
  static constexpr double kUnknown = -1;

  double FindMedian(uint32_t row, uint32_t column) const {
    std::vector<double> near;
    for (uint32_t around = 1; near.size() < kNearPointsMin; ++around) {
      if (around > reach_ || around >= each_way_) return std::numeric_limits<double>::infinity();
      near.clear();
      for (uint32_t r = row - std::min(row, around); r <= std::min(row + around, each_way_ - 1);
           ++r) {
        for (uint32_t c = column - std::min(column, around);
             c <= std::min(column + around, each_way_ - 1); ++c) {
          const std::vector<double>& cell = depths_[r * each_way_ + c];
          near.insert(near.end(), cell.begin(), cell.end());
        }
      }
    }
    return MedianOf(std::move(near));
  }

  uint32_t Row(const Eigen::Vector2d& x_px) const {
    return CellOf(x_px.y(), view_.height_px, each_way_);
  }
  uint32_t Column(const Eigen::Vector2d& x_px) const {
    return CellOf(x_px.x(), view_.width_px, each_way_);
  }

  const MapImage& view_;
  const uint32_t reach_, each_way_;
  std::vector<std::vector<double>> depths_;
  std::vector<double> medians_;  // of the cells that were asked
};

// Expected and found points of each cell.
class Cells {
 public:
  Cells(const MapImage& view, uint32_t each_way)
      : view_(view),
        each_way_(each_way),
        expected_(each_way * each_way),
        found_(expected_.size()) {}

  void Note(const Eigen::Vector2d& x_px, bool is_found) {
    const size_t cell = CellOf(x_px.y(), view_.height_px, each_way_) * each_way_ +
                        CellOf(x_px.x(), view_.width_px, each_way_);
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
  NearDepths near(view, seen, options.depth_cells_each_way, options.hidden_reach_cells);
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
  Cells cells(view, options.cells_each_way);
  for (const ExpectedPoint& point : ListExpected(map, view, seen, points, options))
    cells.Note(point.x_px, point.found.has_value());
  return cells.Judge(options);
}

}  // namespace veduta
