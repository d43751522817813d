// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/picture_cells.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "storage/base/median.h"

namespace veduta {
namespace {

// Points near by that say how far away what a view sees is. Chosen by hand; not measured.
constexpr size_t kNearPointsMin = 3;

constexpr double kUnknown = -1;

// The cell of a picture of `size` px that x lies in, one way.
uint32_t CellOf(double x, uint32_t size, uint32_t each_way) {
  return std::min(static_cast<uint32_t>(std::max(x, 0.0) / size * each_way), each_way - 1);
}

}  // namespace

NearDepths::NearDepths(const MapImage& view, std::span<const SeenDepth> seen,
                       const VisibilityOptions& options)
    : view_(view),
      reach_(options.hidden_reach_cells),
      each_way_(options.depth_cells_each_way),
      depths_(each_way_ * each_way_),
      medians_(each_way_ * each_way_, kUnknown) {
  for (const SeenDepth& one : seen)
    depths_[Row(one.x_px) * each_way_ + Column(one.x_px)].push_back(one.depth);
}

double NearDepths::At(const Eigen::Vector2d& x_px) {
  const uint32_t row = Row(x_px), column = Column(x_px);
  double& median = medians_[row * each_way_ + column];
  if (median == kUnknown) median = FindMedian(row, column);
  return median;
}

double NearDepths::FindMedian(uint32_t row, uint32_t column) const {
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

uint32_t NearDepths::Row(const Eigen::Vector2d& x_px) const {
  return CellOf(x_px.y(), view_.height_px, each_way_);
}

uint32_t NearDepths::Column(const Eigen::Vector2d& x_px) const {
  return CellOf(x_px.x(), view_.width_px, each_way_);
}

FoundCells::FoundCells(const MapImage& view, const VisibilityOptions& options)
    : view_(view),
      options_(options),
      expected_(options.cells_each_way * options.cells_each_way),
      found_(expected_.size()) {}

void FoundCells::Note(const ExpectedPoint& point) {
  const uint32_t each_way = options_.cells_each_way;
  const size_t cell = CellOf(point.x_px.y(), view_.height_px, each_way) * each_way +
                      CellOf(point.x_px.x(), view_.width_px, each_way);
  ++expected_[cell];
  found_[cell] += point.found.has_value();
}

VisibleStructure FoundCells::Judge() const {
  VisibleStructure visible;
  for (size_t i = 0; i < expected_.size(); ++i) {
    visible.expected += expected_[i];
    visible.found += found_[i];
    if (expected_[i] < options_.cell_points_min) continue;
    ++visible.cells;
    visible.missing_cells += found_[i] < options_.cell_found_share_min * expected_[i];
  }
  return visible;
}

}  // namespace veduta
