// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes what has changed in the map into a transaction.

#include <vector>

#include "engine/ingest/placement.h"
#include "engine/mapping/city_map.h"
#include "storage/database.h"

namespace veduta {

// What the image's features see, as it is stored; ascending features.
std::vector<Observation> ObservationsOf(const MapImage& image);

// The poses and observations that changed.
void WritePosesAndObservations(const CityMap& map, Transaction* transaction);

// All that placing a photo changed: poses, observations, point blocks, and the records of the
// reconstructions with their counts, merged ones too. `snapshot` is the state that the map was
// loaded from. The map's record of changes stays as it is.
Status WritePlacementChanges(const CityMap& map, const Snapshot& snapshot,
                             const Placement& placement, Transaction* transaction);

// All that the adjustment of a whole reconstruction changed. Every point has moved, so every block
// is written, ahead of the commit, as a new generation of blocks to which the commit switches; the
// old generation is deleted. Returns the new record, which is in the transaction.
Result<ReconstructionRecord> WriteAdjustment(const CityMap& map, const ReconstructionRecord& before,
                                             Database* database, Transaction* transaction);

}  // namespace veduta
