// SPDX-License-Identifier: Apache-2.0
#pragma once
// Scanline optimisation: the plane of each pixel from its own costs and its neighbours'
// (Hirschmueller 2008, section 2.2).

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/plane_sweep.h"

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

// Along each of eight directions, L(p, k) = C(p, k) + min(m(q, k), m(q, k -+ 1) + penalty_small),
// where q is p's predecessor and m(q, k) = min(L(q, k) - min_i L(q, i), penalty_large(|I_p -
// I_q|)); then the plane of the least sum. In integers throughout: the same bits on the device and,
// where it is null, in C++ on the pool.
//
// O(pixels * planes) time. Memory: 2 bytes for each pixel and plane, besides the volume.
// Thread-safe.
// kInvalidArgument if sizes do not fit, kIoError from the device.
Result<PlaneChoice> ChoosePlanes(const CostVolume& volume, const GrayView& key,
                                 const ScanlineOptions& options, Device* device, ThreadPool& pool);

// SweepPlanes and ChoosePlanes, without the volume leaving the device.
Result<PlaneChoice> SweepAndChoose(const SweepProblem& problem, const ScanlineOptions& options,
                                   Device* device, ThreadPool& pool);

}  // namespace veduta
