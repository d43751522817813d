// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which reconstructions there are: those that were merged into others or dissolved are only
// remembered.

#include <vector>

#include "storage/database.h"

namespace veduta {

// Those that were not merged away or dissolved; most images first, then ascending ids.
// O(reconstructions).
Result<std::vector<ReconstructionRecord>> ListLiving(const Snapshot& snapshot);

// The same, kNotFound, saying what to do, while there is none.
Result<std::vector<ReconstructionRecord>> ListSomeLiving(const Snapshot& snapshot);

// The one with most images; kNotFound, saying what to do, while there is none.
Result<ReconstructionRecord> LargestLiving(const Snapshot& snapshot);

// kNotFound for an unknown one, for one that was merged away, naming where it went, and for one
// that was dissolved.
Result<ReconstructionRecord> GetLiving(const Snapshot& snapshot, ReconstructionId id);

}  // namespace veduta
