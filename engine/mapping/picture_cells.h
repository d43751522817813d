// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is known of a picture by its parts: how far away what the view sees is, and how much of what
// must be there is found.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace veduta {

// A picture in so many cells each way.
struct PictureGrid {
  uint32_t width_px = 0, height_px = 0;
  uint32_t each_way = 1;  // >= 1

  size_t cell_count() const { return size_t{each_way} * each_way; }
  uint32_t Row(const Eigen::Vector2d& x_px) const;
  uint32_t Column(const Eigen::Vector2d& x_px) const;
  size_t CellOf(const Eigen::Vector2d& x_px) const { return Row(x_px) * each_way + Column(x_px); }
};

// How far away what the view sees is, in each part of the picture. Cells that are asked are
// remembered, so one thread at a time.
class NearDepths final {
 public:
  // What the view sees at a place is looked for in so many cells around at most (>= 1).
  NearDepths(const PictureGrid& grid, uint32_t reach_cells);

  // The view sees something there, so far away. Before the first At.
  void Note(const Eigen::Vector2d& x_px, double depth);
  // The median of the cell and of those around it, as far around as it takes to know; infinite
  // where the view sees nothing.
  double At(const Eigen::Vector2d& x_px);

 private:
  double FindMedian(uint32_t row, uint32_t column) const;

  const PictureGrid grid_;
  const uint32_t reach_cells_;
  std::vector<std::vector<double>> depths_;
  std::vector<double> medians_;  // of the cells that were asked
};

// Expected and found points of each cell.
class FoundCells final {
 public:
  struct Sums {
    uint32_t expected = 0, found = 0;       // points
    uint32_t cells = 0, missing_cells = 0;  // with enough points; with too few found of them
  };

  explicit FoundCells(const PictureGrid& grid);
  void Note(const Eigen::Vector2d& x_px, bool is_found);
  // A cell counts that has so many points, and it is missing where a smaller share is found.
  Sums Judge(uint32_t points_min, double found_share_min) const;

 private:
  const PictureGrid grid_;
  std::vector<uint32_t> expected_, found_;
};

}  // namespace veduta
