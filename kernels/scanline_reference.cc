// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>

#include "kernels/plane_sweep_reference.h"
#include "kernels/scan_direction.h"

namespace veduta {
namespace {

// Greater than any m can be, so that there is nothing to gain beyond the first and the last plane.
constexpr uint8_t kBeyond = 128;

// Computes L of one pixel from its predecessor's m (with one cell more on either side), adds it to
// the sums and returns its minimum.
uint8_t StepCosts(const uint8_t* __restrict cost, const uint8_t* __restrict before, uint32_t count,
                  uint8_t penalty_small, uint8_t* __restrict path, uint16_t* __restrict sum) {
  uint8_t least = UINT8_MAX;
  for (uint32_t k = 0; k < count; ++k) {
    const uint8_t step = static_cast<uint8_t>(std::min(before[k], before[k + 2]) + penalty_small);
    const uint8_t value = static_cast<uint8_t>(cost[k] + std::min(before[k + 1], step));
    path[k] = value;
    sum[k] = static_cast<uint16_t>(sum[k] + value);
    least = std::min(least, value);
  }
  return least;
}

// Computes m of that pixel, for its successor.
void NormalizeCosts(const uint8_t* __restrict path, uint32_t count, uint8_t least,
                    uint8_t penalty_large, uint8_t* __restrict before) {
  for (uint32_t k = 0; k < count; ++k) {
    before[k + 1] = std::min(static_cast<uint8_t>(path[k] - least), penalty_large);
  }
}

void RunScanline(const CostVolume& volume, const GrayView& key, const ScanlineOptions& options,
                 const ScanDirection& direction, uint32_t line, uint16_t* sums) {
  const uint32_t stride = volume.plane_stride;
  std::vector<uint8_t> before(stride + 2, 0), path(stride);
  before.front() = before.back() = kBeyond;
  ScanStart at = direction.Start(line, volume.width_px, volume.height_px);
  const auto is_inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < static_cast<int>(volume.width_px) &&
           y < static_cast<int>(volume.height_px);
  };
  while (true) {
    const size_t pixel = static_cast<size_t>(at.y) * volume.width_px + static_cast<size_t>(at.x);
    const uint8_t least = StepCosts(volume.costs.data() + pixel * stride, before.data(), stride,
                                    options.penalty_small, path.data(), sums + pixel * stride);
    const int x = at.x + direction.dx, y = at.y + direction.dy;
    if (!is_inside(x, y)) return;
    const size_t next = static_cast<size_t>(y) * volume.width_px + static_cast<size_t>(x);
    const int difference =
        std::abs(static_cast<int>(key.pixels[pixel]) - static_cast<int>(key.pixels[next]));
    NormalizeCosts(path.data(), stride, least,
                   options.penalty_large[static_cast<size_t>(difference)], before.data());
    at = {x, y};
  }
}

void ChoosePlane(const uint16_t* sum, uint32_t count, size_t pixel, PlaneChoice* choice) {
  uint32_t best = 0;
  for (uint32_t k = 1; k < count; ++k) {
    if (sum[k] < sum[best]) best = k;
  }
  uint16_t second = UINT16_MAX;
  for (uint32_t k = 0; k < count; ++k) {
    if (k + 1 < best || k > best + 1) second = std::min(second, sum[k]);
  }
  choice->plane[pixel] = static_cast<uint16_t>(best);
  choice->cost_before[pixel] = best > 0 ? sum[best - 1] : UINT16_MAX;
  choice->cost[pixel] = sum[best];
  choice->cost_after[pixel] = best + 1 < count ? sum[best + 1] : UINT16_MAX;
  choice->cost_second[pixel] = second;
}

}  // namespace

Status ChoosePlanesReference(const CostVolume& volume, const GrayView& key,
                             const ScanlineOptions& options, ThreadPool& pool,
                             const std::stop_token& stop, PlaneChoice* choice) {
  std::vector<uint16_t> sums(volume.costs.size(), 0);
  for (const ScanDirection& direction : kScanDirectionTable) {
    // Lines of one direction share no pixel.
    pool.ParallelFor(direction.LineCount(volume.width_px, volume.height_px), [&](size_t line) {
      if (stop.stop_requested()) return;
      RunScanline(volume, key, options, direction, static_cast<uint32_t>(line), sums.data());
    });
  }
  pool.ParallelFor(volume.height_px, [&](size_t y) {
    if (stop.stop_requested()) return;
    for (size_t pixel = y * volume.width_px; pixel < (y + 1) * volume.width_px; ++pixel) {
      ChoosePlane(sums.data() + pixel * volume.plane_stride, volume.plane_count, pixel, choice);
    }
  });
  return stop.stop_requested() ? Status::Cancelled("the scanline optimisation was stopped")
                               : Status::Ok();
}

}  // namespace veduta
