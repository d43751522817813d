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
uint32_t CellOfLine(double x, uint32_t size, uint32_t each_way) {
  return std::min(static_cast<uint32_t>(std::max(x, 0.0) / size * each_way), each_way - 1);
}

}  // namespace

uint32_t PictureGrid::Row(const Eigen::Vector2d& x_px) const {
  return CellOfLine(x_px.y(), height_px, each_way);
}

uint32_t PictureGrid::Column(const Eigen::Vector2d& x_px) const {
  return CellOfLine(x_px.x(), width_px, each_way);
}

NearDepths::NearDepths(const PictureGrid& grid, uint32_t reach_cells)
    : grid_(grid),
      reach_cells_(reach_cells),
      depths_(grid.cell_count()),
      medians_(grid.cell_count(), kUnknown) {}

void NearDepths::Note(const Eigen::Vector2d& x_px, double depth) {
  depths_[grid_.CellOf(x_px)].push_back(depth);
}

double NearDepths::At(const Eigen::Vector2d& x_px) {
  double& median = medians_[grid_.CellOf(x_px)];
  if (median == kUnknown) median = FindMedian(grid_.Row(x_px), grid_.Column(x_px));
  return median;
}

double NearDepths::FindMedian(uint32_t row, uint32_t column) const {
  const uint32_t each_way = grid_.each_way;
  std::vector<double> near;
  for (uint32_t around = 1; near.size() < kNearPointsMin; ++around) {
    if (around > reach_cells_ || around >= each_way) return std::numeric_limits<double>::infinity();
    near.clear();
    for (uint32_t r = row - std::min(row, around); r <= std::min(row + around, each_way - 1); ++r) {
      for (uint32_t c = column - std::min(column, around);
           c <= std::min(column + around, each_way - 1); ++c) {
        const std::vector<double>& cell = depths_[r * each_way + c];
        near.insert(near.end(), cell.begin(), cell.end());
      }
    }
  }
  return MedianOf(std::move(near));
}

FoundCells::FoundCells(const PictureGrid& grid)
    : grid_(grid), expected_(grid.cell_count()), found_(grid.cell_count()) {}

void FoundCells::Note(const Eigen::Vector2d& x_px, bool is_found) {
  const size_t cell = grid_.CellOf(x_px);
  ++expected_[cell];
  found_[cell] += is_found;
}

FoundCells::Sums FoundCells::Judge(uint32_t points_min, double found_share_min) const {
  Sums sums;
  for (size_t i = 0; i < expected_.size(); ++i) {
    sums.expected += expected_[i];
    sums.found += found_[i];
    if (expected_[i] < points_min) continue;
    ++sums.cells;
    sums.missing_cells += found_[i] < found_share_min * expected_[i];
  }
  return sums;
}

}  // namespace veduta
