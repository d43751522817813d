// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation_problem.h"

#include <algorithm>
#include <string>

#include "storage/base/option_bounds.h"

namespace veduta {

Status TvProblem::Check() const {
  const size_t voxels = static_cast<size_t>(block_count) * kTvBlockVoxels;
  if (neighbors.size() != 6 * static_cast<size_t>(block_count) ||
      weights.size() != kTvBins * voxels || centers.size() != kTvNearBins * voxels) {
    return Status::InvalidArgument("neighbours, weights or centres do not fit " +
                                   std::to_string(block_count) + " blocks");
  }
  VEDUTA_RETURN_IF_ERROR(OptionBounds().FiniteAbove("lambda", lambda, 0).status());
  for (size_t i = 0; i < neighbors.size(); ++i) {
    const int32_t other = neighbors[i];
    if (other < -1 || other >= static_cast<int32_t>(block_count) ||
        (other >= 0 &&
         neighbors[6 * static_cast<size_t>(other) + (i % 6 ^ 1)] != static_cast<int32_t>(i / 6))) {
      return Status::InvalidArgument("block " + std::to_string(i / 6) + " and its neighbour " +
                                     std::to_string(other) + " do not name each other");
    }
  }
  return Status::Ok();
}

}  // namespace veduta
