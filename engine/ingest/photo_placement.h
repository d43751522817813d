// SPDX-License-Identifier: Apache-2.0
#pragma once
// Decides which of the four cases of the paper's section 3.3 a photo is (R13), and carries it out
// on the map.

#include <span>

#include "engine/ingest/mapping_context.h"
#include "engine/ingest/placement.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

// Places a photo by its verified pairs. `new_reconstruction` is the id that a founded
// reconstruction takes; where it is not valid(), the photo founds none. Obeys what people have
// forbidden: a photo that must not have a pose is postponed, and nobody founds with one. When it is
// postponed, the map holds what was loaded, or nothing. After an error the map may be half changed:
// the caller clears it. Deterministic in its inputs and the seed.
Result<Placement> PlacePhoto(const MappingContext& context, const ImageFeatures& photo,
                             std::span<const PairMatches> pairs,
                             ReconstructionId new_reconstruction, uint64_t seed);

}  // namespace veduta
