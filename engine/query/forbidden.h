// SPDX-License-Identifier: Apache-2.0
#pragma once
// What people have forbidden, followed through merges.

#include "storage/base/status.h"
#include "storage/database.h"

namespace veduta {

// The reconstruction that `id` has become by merges: `id` itself where it was not merged; one that
// lives, or was dissolved since. kNotFound; kCorruption where merges lead round in a circle.
// O(merges).
Result<ReconstructionId> LivingEnd(const Snapshot& snapshot, ReconstructionId id);

// Whether somebody has forbidden that these two, or two of which they have come by merges, are
// merged. O(what is forbidden), a few reads each.
Result<bool> IsMergeForbidden(const Snapshot& snapshot, ReconstructionId a, ReconstructionId b);

}  // namespace veduta
