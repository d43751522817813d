// SPDX-License-Identifier: Apache-2.0
#pragma once
// Starts a reconstruction from a photo and two of its neighbours that have no pose either: the
// paper's third case (R13, R17).

#include <span>
#include <string>
#include <vector>

#include "engine/ingest/mapping_context.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

struct ReconstructionStart {
  FoundingOutcome outcome = FoundingOutcome::kNoPair;
  uint32_t view_count = 0;      // candidates, with the photo; fewer than 3 found nothing
  std::vector<ImageId> placed;  // the photo first, then the other two in ascending ids but for the
                                // one whose place the photo took
  uint32_t point_count = 0;     // of the triple, before the map grew around it
};

// Where it succeeds, the three images are in the map under `id`, with their surroundings grown and
// adjusted; otherwise the map is as before, but for what was loaded. Deterministic in its inputs
// and the seed.
Result<ReconstructionStart> StartReconstruction(const MappingContext& context,
                                                const ImageFeatures& photo,
                                                std::span<const PairMatches> pairs,
                                                ReconstructionId id, uint64_t seed);

// Why none was started, for a person. `pair_count`: the photo's verified neighbours.
std::string NoStartDetail(const ReconstructionStart& start, size_t pair_count);

}  // namespace veduta
