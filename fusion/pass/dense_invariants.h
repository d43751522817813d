// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks every invariant of what the dense pass stores.

#include <string>
#include <vector>

#include "storage/database.h"

namespace veduta {

// A sentence for each violation, naming the records; empty when all holds, also between two pieces
// of a pass that was killed. Stops after `count_max`. Parses every value: one that cannot be read
// is a violation, and the others are checked all the same. O(what the pass stored). Thread-safe.
Result<std::vector<std::string>> FindDenseViolations(const Snapshot& snapshot, size_t count_max);

}  // namespace veduta
