// SPDX-License-Identifier: Apache-2.0
#pragma once
// Within kernels/: which bins each row of 16 voxels uses.

#include <vector>

#include "kernels/total_variation.h"

namespace veduta {

// [block_count x 256] bit j: bin j is not empty somewhere in the row.
std::vector<uint32_t> BinsOfRows(const TvProblem& problem);

}  // namespace veduta
