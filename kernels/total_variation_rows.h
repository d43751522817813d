// SPDX-License-Identifier: Apache-2.0
#pragma once
// Within kernels/: what each row of 16 voxels holds.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/total_variation_problem.h"

namespace veduta {

// [block_count x 256]. Bit j < 8 says that bin j is not empty somewhere in the row, bit 16 + i that
// voxel i is observed. So 0 says that nobody saw the row.
std::vector<uint32_t> BitsOfRows(const TvProblem& problem);

// `p` changed to fit the problem: 0 where no difference is taken, |p| <= 1 elsewhere.
std::vector<float> FitDual(const TvProblem& problem, const std::vector<uint32_t>& bits,
                           std::span<const float> p);

}  // namespace veduta
