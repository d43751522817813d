// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks every invariant between the record families.

#include <string>
#include <vector>

#include "storage/database.h"

namespace veduta {

struct CheckOptions {
  size_t count_max = 1000;  // of violations
  // Also reads every file's checksums, decodes the headers of photos, and derives words from
  // features again.
  bool deep = false;
};

// A sentence for each violation, naming the records; empty when the database is sound. Stops after
// `count_max`. Parses every value: one that cannot be read is a violation, and the rest is checked
// all the same. What is half-written under a mark is none. O(database). Thread-safe.
Result<std::vector<std::string>> FindViolations(const Snapshot& snapshot,
                                                const CheckOptions& options);
inline Result<std::vector<std::string>> FindViolations(const Snapshot& snapshot, size_t count_max) {
  return FindViolations(snapshot, CheckOptions{.count_max = count_max});
}

}  // namespace veduta
