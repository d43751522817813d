// SPDX-License-Identifier: Apache-2.0
#pragma once
// A block's histograms of truncated signed distances: what all maps together say about each voxel,
// in integers, so that a map can be added or withdrawn at any time and the bytes do not depend on
// the order. Source: C. Zach, Fast and high quality fusion of depth maps, 3DPVT 2008; the means
// within bins are ours.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fusion/volume/grid.h"
#include "fusion/volume/range_image.h"
#include "storage/base/status.h"

namespace veduta {

// Part of the version of every histogram: raise it whenever a change of the code changes what
// Integrate adds (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kHistogramVersion = 1;

// Distances in [-1, 1] (of the truncation) fall into kNearBins bins of equal width, from behind the
// surface to before it; what lies farther in front is free space and falls into the last bin, whose
// centre is 1. What lies farther behind is not seen.
inline constexpr int kNearBins = 7;
inline constexpr int kHistogramBins = kNearBins + 1;
inline constexpr int kLevels = 16;  // a near bin's votes are kept to 1/16 of its width

// 131 kB: belongs on the heap.
struct HistogramBlock {
  using Plane = std::array<uint16_t, kBlockVoxels>;  // by VoxelOffset
  std::array<Plane, kHistogramBins> counts{};        // sum of weights
  std::array<Plane, kNearBins> sums{};               // sum of weight times level, 0 to kLevels - 1
  Plane near_maps{};                                 // how many maps voted within the truncation

  bool operator==(const HistogramBlock&) const = default;
  bool IsEmpty() const;  // nobody voted
  // The mean of a bin's votes, in (-1, 1]; of an empty bin its middle.
  float CenterOf(int bin, size_t voxel) const;
};

// Adds (sign +1) a map's votes to the block, or withdraws (sign -1) what the same call added
// before: the same bytes come back. `changed` tells whether any vote was cast. Deterministic on
// every machine (doubles without contraction). Thread-safe for different blocks. About 0.15 ms.
// kInvalidArgument, and the block is as before, if a counter would overflow (some 1000 maps of full
// weight see one voxel) or would fall below zero (the map was never added), or on a bad grid or
// sign.
struct Integration {
  bool changed = false;
};
Result<Integration> Integrate(const RangeImage& image, const VolumeGrid& grid,
                              const GridPlace& index, int sign, HistogramBlock* block);

// Bytes for storage: equal blocks give equal bytes, most voxels take one to six. Parse validates
// all that Integrate guarantees and returns kCorruption otherwise, never reading outside of
// `bytes`.
//   block = version:u8 (1), occupied bins of each voxel:u8 [4096], then for each voxel in order
//   with any: for each occupied bin its count:varint and, but for the last bin, its sum:varint;
//   and, if any near bin is occupied, near_maps:varint. Varints are LEB128, shortest form, 1 to 3
//   bytes.
std::vector<uint8_t> Serialize(const HistogramBlock& block);
Result<std::unique_ptr<HistogramBlock>> ParseHistogramBlock(std::span<const uint8_t> bytes);

}  // namespace veduta
