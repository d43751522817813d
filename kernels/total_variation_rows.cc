// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation_rows.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace veduta {

std::vector<uint32_t> BitsOfRows(const TvProblem& problem) {
  std::vector<uint32_t> bits(static_cast<size_t>(problem.block_count) * kTvRowsOfBlock, 0);
  for (size_t block = 0; block < problem.block_count; ++block) {
    for (uint32_t bin = 0; bin < kTvBins; ++bin) {
      const uint16_t* weights = problem.weights.data() + (block * kTvBins + bin) * kTvBlockVoxels;
      for (uint32_t i = 0; i < kTvBlockVoxels; ++i) {
        if (weights[i] != 0)
          bits[block * kTvRowsOfBlock + i / kTvRow] |= 1u << bin | 1u << (16 + i % kTvRow);
      }
    }
  }
  return bits;
}

std::vector<float> FitDual(const TvProblem& problem, const std::vector<uint32_t>& bits,
                           std::span<const float> p) {
  const size_t voxels = static_cast<size_t>(problem.block_count) * kTvBlockVoxels;
  constexpr std::array<size_t, 3> steps = {1, kTvRow, static_cast<size_t>(kTvRow) * kTvRow};
  const auto is_observed = [&](size_t voxel) {
    return (bits[voxel / kTvRow] >> (16 + voxel % kTvRow) & 1) != 0;
  };
  std::vector<float> fitted(3 * voxels, 0.f);
  for (size_t voxel = 0; voxel < voxels; ++voxel) {
    if (!is_observed(voxel)) continue;
    std::array<float, 3> here{};
    for (size_t axis = 0; axis < 3; ++axis) {
      size_t next = voxel + steps[axis];
      if (voxel / steps[axis] % kTvRow == kTvRow - 1) {
        const int32_t block = problem.neighbors[6 * (voxel / kTvBlockVoxels) + 2 * axis + 1];
        if (block < 0) continue;
        next = static_cast<size_t>(block) * kTvBlockVoxels + voxel % kTvBlockVoxels -
               (kTvRow - 1) * steps[axis];
      }
      if (is_observed(next)) here[axis] = p[axis * voxels + voxel];
    }
    const float norm = std::sqrt((here[0] * here[0] + here[1] * here[1]) + here[2] * here[2]);
    for (size_t axis = 0; axis < 3; ++axis)
      fitted[axis * voxels + voxel] = here[axis] / std::max(norm, 1.f);
  }
  return fitted;
}

}  // namespace veduta
