// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes a placement into a transaction: what changed in the map, the founding triple's verdicts,
// the journal of merges, hypotheses, and the photos that are to be tried again because of it (R16).

#include <span>

#include "engine/ingest/placement.h"
#include "engine/mapping/city_map.h"
#include "storage/database.h"

namespace veduta {

// Writes the placement. Of a postponed photo it writes only the doubt that the photo raises. The
// photo's own image record is the caller's to write. `snapshot` is the state that the map was
// loaded from; `unstored` are the photo's neighbours by pairs that are not in it yet (retries.h).
// Changes `state`, which the caller puts into the transaction last.
Status WritePlacement(const CityMap& map, const Snapshot& snapshot, const Placement& placement,
                      std::span<const ImageId> unstored, DatabaseState* state,
                      Transaction* transaction);

}  // namespace veduta
