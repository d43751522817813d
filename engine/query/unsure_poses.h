// SPDX-License-Identifier: Apache-2.0
#pragma once
// Images whose pose nobody is told, because they may as well stand elsewhere.

#include <map>
#include <vector>

#include "storage/database.h"

namespace veduta {

using UnsureImages = std::map<ImageId, std::vector<ReconstructionId>>;

// The images that stand at a seam of two places that look alike, on a side that is not sure
// (HypothesisRecord::unsure), each with the reconstructions on whose side it may stand as well,
// ascending. What they see holds their reconstruction together all the same, for it looks alike on
// either side. O(hypotheses).
Result<UnsureImages> ListUnsure(const Snapshot& snapshot);

}  // namespace veduta
