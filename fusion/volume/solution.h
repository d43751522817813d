// SPDX-License-Identifier: Apache-2.0
#pragma once
// A block of the fused signed distance function, as it is stored and as surface is extracted from
// it.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fusion/volume/grid.h"
#include "fusion/volume/histogram.h"
#include "storage/base/status.h"

namespace veduta {

inline constexpr int kSolutionOne = 32767;  // the stored value of u = 1
inline constexpr int kDualOne = 127;

// 24 kB.
struct SolutionBlock {
  // Of voxels that nobody saw: the mean of those on their faces that somebody saw, 0 where fewer
  // than four are.
  std::array<int16_t, kBlockVoxels>
      value{};  // u in [-1, 1] times kSolutionOne; negative within matter; VoxelOffset
  std::array<uint8_t, kBlockVoxels>
      support{};  // 0: nobody saw the voxel; else 1 + maps within the truncation, <= 255
  // The dual variables along x, y and z times kDualOne, each in [-1, 1]: a start near the next
  // minimum.
  std::array<std::array<int8_t, kBlockVoxels>, 3> dual{};

  bool operator==(const SolutionBlock&) const = default;
};

// support of a voxel as SolutionBlock has it.
uint8_t SupportOf(const HistogramBlock& block, size_t voxel);

// A solved block beside where it lies.
struct SolvedBlock {
  GridPlace index;
  std::unique_ptr<SolutionBlock> solution;
};

// block = version:u8 (1), value:i16 little-endian [4096], support:u8 [4096], dual:i8 [3 x 4096].
// Left to the database's compression. Parse: kCorruption on a wrong size or version or a value out
// of range.
std::vector<uint8_t> Serialize(const SolutionBlock& block);
Result<std::unique_ptr<SolutionBlock>> ParseSolutionBlock(std::span<const uint8_t> bytes);

}  // namespace veduta
