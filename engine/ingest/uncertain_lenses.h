// SPDX-License-Identifier: Apache-2.0
#pragma once
// Focal lengths that photos of the city alone have told are known to some percent until many photos
// have refined them (lens_refinement.h). Until then the rotation that a pair finds by itself says
// less of whether poses are right.

#include <set>

#include "engine/ingest/map_loader.h"
#include "engine/mapping/neighbor_agreement.h"
#include "storage/database.h"

namespace veduta {

// Of the members of a reconstruction those whose focal lengths are not known well: few images of
// their cameras are among the members. O(members).
Result<std::set<ImageId>> ListUncertainLenses(const Snapshot& snapshot,
                                              const std::set<ImageId>& members);

// Of images with poses those whose focal lengths may not be known well because their reconstruction
// is young. O(images).
Result<std::set<ImageId>> ListYoungLenses(MapLoader* loader, const CityMap& map,
                                          const std::set<ImageId>& images);

// The options by which a pair is asked one of whose focal lengths is not known well.
AgreementOptions OfUncertainLenses(AgreementOptions options);

}  // namespace veduta
