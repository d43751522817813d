// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where one image's keypoints lie: finds those near a position or along a line.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/matching/contrast_class.h"
#include "storage/base/ids.h"
#include "storage/model/features.h"

namespace veduta {

// A line a x + b y + c = 0 in px; any scale.
struct ImageLine {
  double a = 0, b = 0, c = 0;
};

// Immutable: thread-safe. Keypoints are kept twice, in slabs across x and in slabs across y, so
// that a line of either slant crosses few slabs. Each contrast class has its own slabs. 4200
// keypoints are built in about 0.1 ms and take about 35 bytes each (veduta_matching_benchmark).
class FeatureGrid final {
 public:
  FeatureGrid() = default;
  // Keypoints that are not finite are in no answer.
  explicit FeatureGrid(const Features& features);

  // How many features it was built from.
  size_t feature_count() const { return feature_count_; }
  size_t size_bytes() const;

  // Appends the features of one contrast class within `radius_px` (inclusive) of (x_px, y_px).
  // Their order is of no use, but always the same. Nothing when an argument is not finite.
  void FindNearPoint(int contrast, double x_px, double y_px, double radius_px,
                     std::vector<FeatureIndex>* found) const;

  // Appends the features of one contrast class within `band_px` (inclusive) of the line. Their
  // order is of no use, but always the same. Nothing when the line is no line (a = b = 0) or an
  // argument is not finite.
  void FindNearLine(int contrast, const ImageLine& line, double band_px,
                    std::vector<FeatureIndex>* found) const;

 private:
  struct Entry {
    float x_px, y_px;
    FeatureIndex feature;
  };

  // Slabs across one axis (u) are cut into cells along the other (v); the entries of a slab lie in
  // one run.
  struct Slabs {
    double u_min = 0, v_min = 0;
    double slab_px = 1;
    double slabs_per_px = 1, cells_per_px = 1;
    uint32_t slab_count = 0, cell_count = 0;  // cells in a slab
    std::vector<uint32_t> starts;             // [slab_count * cell_count + 1], into entries
    std::vector<Entry> entries;

    double SlabPosition(double u) const { return (u - u_min) * slabs_per_px; }
    double CellPosition(double v) const { return (v - v_min) * cells_per_px; }
    // The entries of one slab in the cells between two positions; those at the ends may lie outside
    // of them. Empty where no cell is between.
    std::span<const Entry> Run(uint32_t slab, double first_cell, double last_cell) const;
  };

  static Slabs Build(const std::vector<Entry>& entries, bool across_x);

  size_t feature_count_ = 0;
  std::array<Slabs, kContrastClassCount>
      across_x_;  // u = x, v = y: for lines that are rather level
  std::array<Slabs, kContrastClassCount> across_y_;  // u = y, v = x: for steep ones
};

}  // namespace veduta
