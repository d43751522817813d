// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the stored settings tell of a surface (fusion/pass/staged_surface.h).

#include <optional>

#include "storage/base/status.h"
#include "storage/database.h"

namespace veduta {

// Whether the reconstruction's surface moves tile by tile: step 3.
Result<bool> IsMoving(const Snapshot& snapshot, ReconstructionId reconstruction);

// The settings of the last pass, finished or not; none where there was none.
Result<std::optional<DenseSettings>> FindLastSettings(const Snapshot& snapshot,
                                                      ReconstructionId reconstruction);

}  // namespace veduta
