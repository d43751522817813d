// SPDX-License-Identifier: Apache-2.0
#pragma once
// Takes the pose of one image, and of those that cannot stand without it, touching only what is
// around them. What is left is adjusted, and split where it falls apart, by the next adjustment of
// the whole reconstruction, which this makes due.

#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/ingest/ingest_options.h"
#include "engine/ingest/map_loader.h"
#include "storage/database.h"

namespace veduta {

// The points that an image in the map sees. O(its features).
uint32_t CountObservations(const MapImage& image);

// Takes the poses of these images of one reconstruction in the map. Then, in ascending ids and
// until nothing changes, those of the images that shared points with one that lost its own and see
// fewer than `observations_min` points now; and all of them where fewer than three images would be
// left in the reconstruction. Returns the others, ascending. Deterministic. O(neighbourhood of
// these images).
Result<std::vector<ImageId>> UnplaceWithDependents(std::span<const ImageId> images,
                                                   uint32_t observations_min, MapLoader* loader,
                                                   CityMap* map);

// Writes what has changed in the map by UnplaceWithDependents or by an exchange of pictures: poses,
// observations, point blocks, and the record of the reconstruction, whose adjustment is due; it is
// dissolved where no image is left. The map's record of changes stays as it is.
Status WriteChangedLocally(const CityMap& map, const Snapshot& snapshot, Transaction* transaction);

// The images that were doubted and lost their poses since a person last did something, such as
// adding a photo: reads the journal backwards over the steps that followed by themselves, up to the
// first other entry; over so many `photos` that were added, too. O(the entries read).
Result<std::set<ImageId>> AlreadyDoubted(const Snapshot& base, uint64_t next_journal,
                                         uint32_t photos = 0);

// The parts that were split off since then, the last one first.
Result<std::vector<ReconstructionId>> ListSplitOff(const Snapshot& base, uint64_t next_journal,
                                                   uint32_t photos = 0);

// How many of the parts have been merged into this reconstruction. O(their merges).
Result<size_t> CountMergedInto(const Snapshot& base, std::span<const ReconstructionId> parts,
                               ReconstructionId into);

// Postpones images that have just lost their poses, with `detail` as the reason, and has them tried
// again at once. The images must still be stored.
Status PostponeImages(const Snapshot& snapshot, std::span<const ImageId> images,
                      ReconstructionId from, const std::string& detail, DatabaseState* state,
                      Transaction* transaction);

}  // namespace veduta
