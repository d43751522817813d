// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/feature_grid.h"

#include <algorithm>
#include <cmath>

namespace veduta {
namespace {

// The fastest of slabs of 32 to 256 px and cells of 4 to 16 px for lines over 4200 keypoints of
// 1536 x 1024 px (veduta_matching_benchmark): many short runs cost more than a few long ones, whose
// entries are tested without a branch.
constexpr double kSlabPx = 128;
constexpr double kCellPx = 8;
// At most so many cells per keypoint, so that a few keypoints that are far apart do not take much
// memory. Chosen by hand.
constexpr double kCellsPerEntry = 4;
// Rounding never moves a position by this share of a cell or slab.
constexpr double kSlack = 1e-6;

// The nearest of 0 .. count - 1; not for NaN.
uint32_t Clamp(double position, uint32_t count) {
  return static_cast<uint32_t>(std::min(std::max(position, 0.0), static_cast<double>(count - 1)));
}

}  // namespace

std::span<const FeatureGrid::Entry> FeatureGrid::Slabs::Run(uint32_t slab, double first_cell,
                                                            double last_cell) const {
  first_cell -= kSlack;
  last_cell += kSlack;
  // Written so that NaN has no run.
  if (!(last_cell >= 0 && first_cell <= cell_count)) return {};
  const uint32_t* of_slab = starts.data() + static_cast<size_t>(slab) * cell_count;
  const uint32_t begin = of_slab[Clamp(first_cell, cell_count)];
  const uint32_t end = of_slab[Clamp(last_cell, cell_count) + 1];
  return {entries.data() + begin, entries.data() + end};
}

FeatureGrid::Slabs FeatureGrid::Build(const std::vector<Entry>& entries, bool across_x) {
  Slabs slabs;
  if (entries.empty()) return slabs;
  const auto u_of = [&](const Entry& entry) -> double {
    return across_x ? entry.x_px : entry.y_px;
  };
  const auto v_of = [&](const Entry& entry) -> double {
    return across_x ? entry.y_px : entry.x_px;
  };
  slabs.u_min = u_of(entries[0]);
  slabs.v_min = v_of(entries[0]);
  double u_max = slabs.u_min;
  double v_max = slabs.v_min;
  for (const Entry& entry : entries) {
    slabs.u_min = std::min(slabs.u_min, u_of(entry));
    slabs.v_min = std::min(slabs.v_min, v_of(entry));
    u_max = std::max(u_max, u_of(entry));
    v_max = std::max(v_max, v_of(entry));
  }
  double slab_count = 1 + std::floor((u_max - slabs.u_min) / kSlabPx);
  double cell_count = 1 + std::floor((v_max - slabs.v_min) / kCellPx);
  const double cells_max = 64 + kCellsPerEntry * static_cast<double>(entries.size());
  if (slab_count * cell_count > cells_max) {
    const double shrink = std::sqrt(cells_max / (slab_count * cell_count));
    slab_count = std::clamp(std::floor(slab_count * shrink), 1.0, cells_max);
    cell_count = std::clamp(std::floor(cells_max / slab_count), 1.0, cell_count);
  }
  slabs.slab_count = static_cast<uint32_t>(slab_count);
  slabs.cell_count = static_cast<uint32_t>(cell_count);
  slabs.slab_px = std::max(kSlabPx, (u_max - slabs.u_min) / slab_count);
  slabs.slabs_per_px = 1 / slabs.slab_px;
  slabs.cells_per_px = 1 / std::max(kCellPx, (v_max - slabs.v_min) / cell_count);

  slabs.starts.assign(static_cast<size_t>(slabs.slab_count) * slabs.cell_count + 1, 0);
  std::vector<uint32_t> cell_of(entries.size());
  for (size_t i = 0; i < entries.size(); ++i) {
    cell_of[i] = Clamp(slabs.SlabPosition(u_of(entries[i])), slabs.slab_count) * slabs.cell_count +
                 Clamp(slabs.CellPosition(v_of(entries[i])), slabs.cell_count);
    ++slabs.starts[cell_of[i] + 1];
  }
  for (size_t cell = 1; cell < slabs.starts.size(); ++cell)
    slabs.starts[cell] += slabs.starts[cell - 1];
  std::vector<uint32_t> next(slabs.starts.begin(), slabs.starts.end() - 1);
  slabs.entries.resize(entries.size());
  for (size_t i = 0; i < entries.size(); ++i) slabs.entries[next[cell_of[i]]++] = entries[i];
  return slabs;
}

FeatureGrid::FeatureGrid(const Features& features) : feature_count_(features.size()) {
  std::array<std::vector<Entry>, kContrastClassCount> entries;
  for (size_t i = 0; i < features.size(); ++i) {
    const Keypoint& keypoint = features.keypoints[i];
    if (!std::isfinite(keypoint.x_px) || !std::isfinite(keypoint.y_px)) continue;
    entries[ContrastClassOf(keypoint.contrast_sign)].push_back(
        {keypoint.x_px, keypoint.y_px, static_cast<FeatureIndex>(i)});
  }
  for (int contrast = 0; contrast < kContrastClassCount; ++contrast) {
    across_x_[contrast] = Build(entries[contrast], true);
    across_y_[contrast] = Build(entries[contrast], false);
  }
}

size_t FeatureGrid::size_bytes() const {
  size_t size = sizeof(*this);
  for (const auto* layout : {&across_x_, &across_y_}) {
    for (const Slabs& slabs : *layout) {
      size += slabs.starts.size() * sizeof(uint32_t) + slabs.entries.size() * sizeof(Entry);
    }
  }
  return size;
}

void FeatureGrid::FindNearPoint(int contrast, double x_px, double y_px, double radius_px,
                                std::vector<FeatureIndex>* found) const {
  const Slabs& slabs = across_x_[contrast];
  if (slabs.entries.empty() || !(radius_px >= 0)) return;
  if (!std::isfinite(x_px) || !std::isfinite(y_px) || !std::isfinite(radius_px)) return;
  const double first = slabs.SlabPosition(x_px - radius_px) - kSlack;
  const double last = slabs.SlabPosition(x_px + radius_px) + kSlack;
  if (last < 0 || first > slabs.slab_count) return;
  const double first_cell = slabs.CellPosition(y_px - radius_px);
  const double last_cell = slabs.CellPosition(y_px + radius_px);
  for (uint32_t slab = Clamp(first, slabs.slab_count); slab <= Clamp(last, slabs.slab_count);
       ++slab) {
    for (const Entry& entry : slabs.Run(slab, first_cell, last_cell)) {
      const double dx = entry.x_px - x_px;
      const double dy = entry.y_px - y_px;
      if (dx * dx + dy * dy <= radius_px * radius_px) found->push_back(entry.feature);
    }
  }
}

void FeatureGrid::FindNearLine(int contrast, const ImageLine& line, double band_px,
                               std::vector<FeatureIndex>* found) const {
  const double length = std::hypot(line.a, line.b);
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(line.c)) return;
  if (!(band_px >= 0) || !std::isfinite(band_px)) return;
  const bool level = std::abs(line.b) >= std::abs(line.a);
  const Slabs& slabs = level ? across_x_[contrast] : across_y_[contrast];
  if (slabs.entries.empty()) return;
  // The line is v = slope u + offset with |slope| <= 1. From here on v counts in cells and u in
  // slabs.
  const double slope = level ? -line.a / line.b : -line.b / line.a;
  const double offset = -line.c / (level ? line.b : line.a);
  const double cells_per_slab = slope * slabs.slab_px * slabs.cells_per_px;
  const double at_start = slabs.CellPosition(slope * slabs.u_min + offset);
  const double reach =
      band_px * length / std::max(std::abs(line.a), std::abs(line.b)) * slabs.cells_per_px;
  const double before = std::min(cells_per_slab, 0.0) - reach;
  const double after = std::max(cells_per_slab, 0.0) + reach;
  const double limit = band_px * length;
  // Most entries of a run are outside of the band, in an order that no processor can predict: so
  // there is no branch on it.
  std::array<FeatureIndex, 128> kept;
  size_t kept_count = 0;
  for (uint32_t slab = 0; slab < slabs.slab_count; ++slab) {
    const double at_slab = at_start + cells_per_slab * slab;
    for (const Entry& entry : slabs.Run(slab, at_slab + before, at_slab + after)) {
      const double residual = line.a * entry.x_px + line.b * entry.y_px + line.c;
      kept[kept_count] = entry.feature;
      kept_count += std::abs(residual) <= limit;
      if (kept_count < kept.size()) continue;
      found->insert(found->end(), kept.begin(), kept.end());
      kept_count = 0;
    }
  }
  found->insert(found->end(), kept.begin(), kept.begin() + kept_count);
}

}  // namespace veduta
