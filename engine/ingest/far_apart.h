// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether two reconstructions are told to be at different places of the earth than a merge of them
// would have them.

#include <optional>

#include "engine/ingest/map_loader.h"
#include "engine/ingest/seam.h"

namespace veduta {

// By how many metres on the plan the other side of the seam, carried over by the similarity, lies
// from where that side's own place on the earth has it, where this is far more than both places may
// be off (EarthPlace::covariance): the two may be alike and apart. Nothing otherwise, and where not
// both have a place. Heights are not asked, for nobody says what they are above.
Result<std::optional<double>> FindFarApart(const Snapshot& snapshot, const CityMap& map,
                                           const SeamArea& seam, ReconstructionId into,
                                           ReconstructionId other, const Sim3& into_from_other);

}  // namespace veduta
