// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/stray_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr size_t kCellsMax = 256;  // in a row or column: a tiny radius must not fill the memory

struct SeenPoint {
  PointId id;
  double x_px, y_px, depth;
};

// What one image sees: points of two views, and those that tell where the surface is, in cells.
class Look {
 public:
  Look(const CityMap& map, const MapImage& image, const StrayOptions& options)
      : options_(options), radius_px_(std::max(1.0, options.radius_share * image.width_px)) {
    columns_ = CellOf(image.width_px, kCellsMax) + 1;
    rows_ = CellOf(image.height_px, kCellsMax) + 1;
    cells_.resize(columns_ * rows_);
    for (FeatureIndex f = 0; f < image.points.size(); ++f) {
      const PointRecord* const point =
          image.points[f].valid() ? map.FindPoint(image.points[f]) : nullptr;
      if (point == nullptr) continue;
      const Keypoint& k = image.features->keypoints[f];
      const SeenPoint seen{point->id, k.x_px, k.y_px, (image.cam_from_world * point->position).z()};
      if (point->track.size() == 2) of_two_.push_back(seen);
      if (point->track.size() > 2 && seen.depth > 0)
        cells_[CellOf(k.y_px, rows_) * columns_ + CellOf(k.x_px, columns_)].push_back(seen);
    }
  }

  // The points of two views that stray here.
  std::vector<PointId> Stray() const {
    std::vector<PointId> stray;
    for (const SeenPoint& point : of_two_) {
      if (Strays(point)) stray.push_back(point.id);
    }
    return stray;
  }

 private:
  // The nearest of 0 .. count - 1: what is stored may lie beside the picture. NaN is in the first.
  size_t CellOf(double px, size_t count) const {
    const double cell = std::floor(px / radius_px_);
    return cell > 0 ? static_cast<size_t>(std::min(cell, static_cast<double>(count - 1))) : 0;
  }

  bool Strays(const SeenPoint& point) const {
    uint32_t count = 0;
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
    const size_t row = CellOf(point.y_px, rows_), column = CellOf(point.x_px, columns_);
    for (size_t r = row - std::min<size_t>(row, 1); r < std::min(row + 2, rows_); ++r) {
      for (size_t c = column - std::min<size_t>(column, 1); c < std::min(column + 2, columns_);
           ++c) {
        for (const SeenPoint& other : cells_[r * columns_ + c]) {
          if (std::hypot(other.x_px - point.x_px, other.y_px - point.y_px) > radius_px_) continue;
          ++count;
          nearest = std::min(nearest, other.depth);
          farthest = std::max(farthest, other.depth);
        }
      }
    }
    return count >= options_.surrounding_min &&
           (point.depth > farthest * (1 + options_.depth_share_max) ||
            point.depth < nearest * (1 - options_.depth_share_max));
  }

  const StrayOptions& options_;
  const double radius_px_;
  size_t columns_ = 1, rows_ = 1;
  std::vector<std::vector<SeenPoint>> cells_;  // of points of three and more views, by rows
  std::vector<SeenPoint> of_two_;
};

}  // namespace

Status StrayOptions::Check() const {
  return OptionBounds()
      .AboveUpTo("radius_share", radius_share, 0, 1)
      .AtLeast("surrounding_min", surrounding_min, 1)
      .Above("depth_share_max", depth_share_max, 0)
      .status();
}

uint32_t RemoveStrayPoints(CityMap* map, std::span<const ImageId> images,
                           const StrayOptions& options, ThreadPool* pool) {
  std::vector<std::vector<PointId>> stray(images.size());
  pool->ParallelFor(images.size(), [&](size_t i) {
    if (map->HasImage(images[i])) stray[i] = Look(*map, map->image(images[i]), options).Stray();
  });
  std::map<PointId, uint32_t> votes;
  for (const std::vector<PointId>& of_image : stray) {
    for (const PointId id : of_image) ++votes[id];
  }
  uint32_t removed = 0;
  for (const auto& [id, count] : votes) {
    if (count < 2) continue;
    map->RemovePoint(id);
    ++removed;
  }
  return removed;
}

}  // namespace veduta
