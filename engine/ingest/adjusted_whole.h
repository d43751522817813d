// SPDX-License-Identifier: Apache-2.0
#pragma once
// What an adjustment has taken out of a reconstruction.

#include <vector>

#include "engine/door/submission.h"

namespace veduta {

struct AdjustedWhole {
  std::vector<LostPose> unplaced;           // in the order in which they lost their poses
  std::vector<ReconstructionId> split_off;  // ascending
};

}  // namespace veduta
