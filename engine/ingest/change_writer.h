// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes what has changed in the map into a transaction.

#include <vector>

#include "engine/ingest/placement.h"
#include "engine/ingest/submaps.h"
#include "engine/mapping/city_map.h"
#include "storage/database.h"

namespace veduta {

// What the image's features see, as it is stored; ascending features.
std::vector<Observation> ObservationsOf(const MapImage& image);

// The poses and observations that changed.
void WritePosesAndObservations(const CityMap& map, Transaction* transaction);

// All that placing a photo changed: poses, observations, point blocks, and the records of the
// reconstructions with their counts, merged ones too. `snapshot` is the state that the map was
// loaded from, and `submaps` are those of that state. The map's record of changes stays as it is.
Status WritePlacementChanges(const CityMap& map, const Snapshot& snapshot,
                             const Placement& placement, const Submaps& submaps,
                             Transaction* transaction);

// Deletes what is stored of the poses that images have lost. Their point blocks are the caller's.
void WriteUnplaced(const CityMap& map, Transaction* transaction);

// A whole reconstruction as it is in the map, all of whose points may have moved: every block is
// written, ahead of the commit, as the generation that `record` names and to which the commit
// switches. Fills in the counts of `record`, which goes into the transaction; it is dissolved where
// it has no image any more. Deleting an older generation is the caller's.
Status WriteWhole(const CityMap& map, Database* database, Transaction* transaction,
                  ReconstructionRecord* record);

}  // namespace veduta
