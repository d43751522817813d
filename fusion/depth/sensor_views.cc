// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/sensor_views.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

double Cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

// Andrew's monotone chain: corners in order, none on a side; fewer than 3 where all points lie on a
// line.
std::vector<Eigen::Vector2d> ConvexHull(std::vector<Eigen::Vector2d> points) {
  const auto less = [](const auto& a, const auto& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  };
  std::sort(points.begin(), points.end(), less);
  std::vector<Eigen::Vector2d> hull;
  const auto add_all = [&](auto first, auto last) {
    const size_t start = hull.size();
    for (auto it = first; it != last; ++it) {
      while (hull.size() >= start + 2 && Cross(hull[hull.size() - 2], hull.back(), *it) <= 0)
        hull.pop_back();
      hull.push_back(*it);
    }
    if (!hull.empty()) hull.pop_back();  // it begins the other half
  };
  add_all(points.begin(), points.end());
  add_all(points.rbegin(), points.rend());
  return hull;
}

bool IsInside(const std::vector<Eigen::Vector2d>& hull, const Eigen::Vector2d& x) {
  for (size_t i = 0; i < hull.size(); ++i) {
    if (Cross(hull[i], hull[(i + 1) % hull.size()], x) < 0) return false;
  }
  return hull.size() >= 3;
}

// The middles of the relevant cells, px.
std::vector<Eigen::Vector2d> RelevantCells(const KeyView& key, const SensorViewOptions& options) {
  const double cell_px =
      static_cast<double>(std::max(key.width_px, key.height_px)) / options.cells_across;
  const int columns = static_cast<int>(std::ceil(key.width_px / cell_px));
  const int rows = static_cast<int>(std::ceil(key.height_px / cell_px));
  std::vector<uint32_t> counts(static_cast<size_t>(columns) * rows);
  for (const Eigen::Vector2d& x : key.features) {
    const int column = static_cast<int>(std::floor((x.x() + 0.5) / cell_px));
    const int row = static_cast<int>(std::floor((x.y() + 0.5) / cell_px));
    if (column < 0 || row < 0 || column >= columns || row >= rows) continue;
    for (int r = std::max(0, row - 1); r <= std::min(rows - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(columns - 1, column + 1); ++c) {
        ++counts[static_cast<size_t>(r) * columns + c];
      }
    }
  }
  std::vector<Eigen::Vector2d> middles;
  for (size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] < options.cell_feature_count_min) continue;
    middles.emplace_back((static_cast<double>(i % columns) + 0.5) * cell_px - 0.5,
                         (static_cast<double>(i / columns) + 0.5) * cell_px - 0.5);
  }
  return middles;
}

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * kDegrees;
}

}  // namespace

Status SensorViewOptions::Check() const {
  return OptionBounds()
      .Between("overlap_min", overlap_min, 0, 1)
      .AboveUpTo("angle_best_deg", angle_best_deg, 0, 90)
      .AtLeast("point_count_min", point_count_min, 3)
      .Between("cells_across", cells_across, 4, 256)
      .AtLeast("cell_feature_count_min", cell_feature_count_min, 1)
      .status();
}

double AnglePreference(double angle_deg, double angle_best_deg) {
  return angle_deg * angle_deg * std::exp(-2 * angle_deg / angle_best_deg);
}

Result<std::vector<SensorView>> RankSensorViews(const KeyView& key,
                                                const std::map<ImageId, Eigen::Vector3d>& centers,
                                                const SensorViewOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  if (key.width_px == 0 || key.height_px == 0)
    return Status::InvalidArgument("a key view without size");
  std::map<ImageId, std::vector<const SeenPoint*>> common;
  for (const SeenPoint& point : key.points) {
    for (const ImageId image : point.track) {
      if (centers.contains(image)) common[image].push_back(&point);
    }
  }
  const std::vector<Eigen::Vector2d> cells = RelevantCells(key, options);
  std::vector<SensorView> views;
  for (const auto& [image, points] : common) {
    const Eigen::Vector3d& center = centers.at(image);
    if (points.size() < options.point_count_min || center == key.center) continue;
    std::vector<Eigen::Vector2d> measurements;
    std::vector<double> angles, preferences;
    for (const SeenPoint* point : points) {
      measurements.push_back(point->x_px);
      angles.push_back(AngleDeg(point->position - key.center, point->position - center));
      preferences.push_back(AnglePreference(angles.back(), options.angle_best_deg));
    }
    const std::vector<Eigen::Vector2d> hull = ConvexHull(std::move(measurements));
    const auto covered = std::ranges::count_if(
        cells, [&](const Eigen::Vector2d& cell) { return IsInside(hull, cell); });
    const double overlap =
        cells.empty() ? 0 : static_cast<double>(covered) / static_cast<double>(cells.size());
    if (overlap < options.overlap_min) continue;
    views.push_back({image, overlap, overlap * MedianOf(std::move(preferences)),
                     MedianOf(std::move(angles)), static_cast<uint32_t>(points.size())});
  }
  std::ranges::stable_sort(
      views, [](const SensorView& a, const SensorView& b) { return a.score > b.score; });
  return views;
}

}  // namespace veduta
