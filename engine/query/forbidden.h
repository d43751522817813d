// SPDX-License-Identifier: Apache-2.0
#pragma once
// What people have forbidden, followed through merges.

#include "storage/base/status.h"
#include "storage/database.h"

namespace veduta {

// The reconstruction that `id` has become by merges; `id` itself where none merged it. kNotFound;
// kCorruption where merges lead round in a circle. O(merges).
Result<ReconstructionId> MergedEnd(const Snapshot& snapshot, ReconstructionId id);

// Whether somebody has forbidden that the image has a pose. One read.
Result<bool> IsPoseForbidden(const Snapshot& snapshot, ImageId image);

// Whether somebody has forbidden that these two, or two of which they have come by merges, are
// merged. O(what is forbidden), a few reads each.
Result<bool> IsMergeForbidden(const Snapshot& snapshot, ReconstructionId a, ReconstructionId b);

}  // namespace veduta
