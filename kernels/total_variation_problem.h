// SPDX-License-Identifier: Apache-2.0
#pragma once
// The data of a total variation problem (kernels/total_variation.h).

#include <cstdint>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

inline constexpr uint32_t kTvBlockVoxels = 4096, kTvRow = 16,
                          kTvRowsOfBlock = 256;  // x runs fastest, then y, then z
inline constexpr uint32_t kTvNearBins = 7, kTvBins = 8;
inline constexpr uint32_t kTvCenterLevels = 256;

struct TvProblem {
  uint32_t block_count = 0;
  // [block_count x 6]: the block that follows at -x, +x, -y, +y, -z, +z; -1: none. Must be mutual.
  std::vector<int32_t> neighbors;
  // [block_count x 8 x 4096]: n_j. At most 65535, so that sums are exact in float.
  std::vector<uint16_t> weights;
  // [block_count x 7 x 4096]: where in bin j, of kTvCenterLevels parts: c_j = -1 + 2/7 (j + center
  // / 256). The last bin's is 1.
  std::vector<uint8_t> centers;
  float lambda = 0;  // of a weight of 1

  Status Check() const;  // sizes, neighbours and lambda
};

}  // namespace veduta
