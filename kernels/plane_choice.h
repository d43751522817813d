// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a scanline optimisation is given besides the costs, and what it gives.

#include <array>
#include <cstdint>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

inline constexpr uint32_t kScanDirections = 8;

struct ScanlineOptions {
  // [0, 127] units of cost, between planes k and k +- 1. Chosen by hand; not measured.
  uint8_t penalty_small = 10;
  // [0, 128] units of cost, between planes further apart, by the difference in gray level of the
  // two pixels. The caller sets them (fusion/depth/depth_estimation.cc).
  std::array<uint8_t, 256> penalty_large{};

  Status Check() const;  // the first violated bound, named with its value
};

// One number for each pixel, [height x width]. Costs are summed over the eight directions.
struct PlaneChoice {
  std::vector<uint16_t> plane;  // the cheapest plane; of equally cheap ones the lowest
  // Of plane - 1, of plane and of plane + 1; UINT16_MAX where there is no such plane.
  std::vector<uint16_t> cost_before, cost, cost_after;
  std::vector<uint16_t> cost_second;  // the least of all other planes; UINT16_MAX if there is none
};

}  // namespace veduta
