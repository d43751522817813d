// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is known of a picture by its parts: how far away what the view sees is, and how much of what
// must be there is found.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/mapping/visibility.h"

namespace veduta {

// How far away what the view sees is, in each part of the picture. Cells that are asked are
// remembered, so one thread at a time.
class NearDepths final {
 public:
  // `view` must outlive it.
  NearDepths(const MapImage& view, std::span<const SeenDepth> seen,
             const VisibilityOptions& options);

  // The median of the cell and of those around it, as far around as it takes to know; infinite
  // where the view sees nothing.
  double At(const Eigen::Vector2d& x_px);

 private:
  double FindMedian(uint32_t row, uint32_t column) const;
  uint32_t Row(const Eigen::Vector2d& x_px) const;
  uint32_t Column(const Eigen::Vector2d& x_px) const;

  const MapImage& view_;
  const uint32_t reach_, each_way_;
  std::vector<std::vector<double>> depths_;
  std::vector<double> medians_;  // of the cells that were asked
};

// Expected and found points of each cell.
class FoundCells final {
 public:
  // Both must outlive it.
  FoundCells(const MapImage& view, const VisibilityOptions& options);

  void Note(const ExpectedPoint& point);
  VisibleStructure Judge() const;

 private:
  const MapImage& view_;
  const VisibilityOptions& options_;
  std::vector<uint32_t> expected_, found_;
};

}  // namespace veduta
