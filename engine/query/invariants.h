// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks every invariant between the record families.

#include <string>
#include <vector>

#include "storage/database.h"

namespace veduta {

// A sentence a violation, naming the records; empty when the database is sound. Stops after
// `count_max`. Also parses every value. O(database). Thread-safe.
Result<std::vector<std::string>> FindViolations(const Snapshot& snapshot, size_t count_max);

}  // namespace veduta
