// SPDX-License-Identifier: Apache-2.0
#pragma once
// What an adjusted submap knows of its neighbours, for the relaxation and the judging of the whole
// (relaxation_steps.h): places that both see, and what speaks for and against their belonging
// together.

#include <vector>

#include "engine/ingest/doubt.h"
#include "engine/ingest/mapping_context.h"
#include "engine/ingest/submaps.h"
#include "storage/model/submap.h"

namespace veduta {

// Finds the border of a submap whose region has just been adjusted and healed, in the map as that
// left it. Its ties are points that the submap sees together with another one, and verified matches
// across whose two features see different points: places that a loop has not joined yet. Of the
// ties with each other submap a bounded number is kept: those with most views on both sides, and of
// equal ones those with the lowest hash of their names, so that they are spread. Deterministic;
// O(the region and its pairs).
Result<SubmapBorder> FindBorder(const MappingContext& context, const Submaps& submaps, SubmapId id,
                                const Healing& healing);

// The borders of all submaps of a reconstruction that has just been adjusted and healed as a whole
// and is in the map, in ascending ids. Deterministic at any number of threads; O(its pairs).
Result<std::vector<SubmapBorder>> FindBorders(const MappingContext& context, const Submaps& submaps,
                                              ReconstructionId reconstruction,
                                              const Healing& healing);

}  // namespace veduta
