// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which images have had another photo before.

#include <set>

#include "storage/database.h"

namespace veduta {

// Those whose bytes a larger copy has replaced, as the journal says
// (engine/ingest/better_version.h): their words are those of both, and what the dense pass has made
// of the first one stays until it runs again. O(journal).
Result<std::set<ImageId>> ReplacedImages(const Snapshot& snapshot);

}  // namespace veduta
