// SPDX-License-Identifier: Apache-2.0
#pragma once
// All stages of the dense pass, one after the other.

#include "engine/door/dense.h"
#include "fusion/pass/stage.h"
#include "fusion/pass/stage_options.h"
#include "storage/base/status.h"

namespace veduta {

// From the first to the last; the counts are left in `report`.
Status RunStages(const DenseStageOptions& options, DensePass* pass, DensifyReport* report);

}  // namespace veduta
