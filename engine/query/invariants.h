// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks every invariant between the record families.

#include <string>
#include <vector>

#include "engine/photo/photo_preparer.h"
#include "storage/database.h"

namespace veduta {

struct CheckOptions {
  size_t count_max = 1000;  // of violations
  // Also compares the checksums of all files, reads the headers of photos, and derives words from
  // features again.
  bool deep = false;
  // Where deep: extracts the features of every photo again, and compares them. May be null. To be
  // left out where the photos were added by a version with another extraction.
  const PhotoPreparer* preparer = nullptr;
};

// A sentence for each violation, naming the records; empty when the database is sound. Stops after
// `count_max`. Parses every value: one that cannot be read is a violation, and the rest is checked
// all the same. What is half-written under a mark is none. Where the memory is too short to extract
// features, that is the failure, and no violation. O(database). Thread-safe.
Result<std::vector<std::string>> FindViolations(const Snapshot& snapshot,
                                                const CheckOptions& options);
inline Result<std::vector<std::string>> FindViolations(const Snapshot& snapshot, size_t count_max) {
  return FindViolations(snapshot, CheckOptions{.count_max = count_max});
}

}  // namespace veduta
