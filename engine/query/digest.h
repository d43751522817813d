// SPDX-License-Identifier: Apache-2.0
#pragma once
// One hash over the logical content: equal for equal cities. Times, the journal and how values lie
// on disk are not part of it; every number that is counts to the last bit.

#include "storage/base/content_hash.h"
#include "storage/database.h"

namespace veduta {

// O(database). Thread-safe.
Result<ContentHash> DigestOf(const Snapshot& snapshot);

}  // namespace veduta
