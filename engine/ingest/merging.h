// SPDX-License-Identifier: Apache-2.0
#pragma once
// Merges reconstructions that turn out to share points: the paper's second case (R13, R15).

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/ingest/mapping_context.h"
#include "engine/ingest/merge_candidates.h"
#include "engine/ingest/placement.h"
#include "engine/ingest/seam_loop.h"

namespace veduta {

// The reconstruction that a photo has just got a pose in.
struct MergeRequest {
  ReconstructionId reconstruction;
  bool is_new = false;  // it was founded with the photo and is not stored yet
  // Images that have just got a pose, the photo first; none where no photo leads to the merge.
  std::span<const ImageId> fresh;
  ReconstructionId only = {};  // where valid, no other one is merged
};

// A merge by points that agree, against which something else speaks.
struct RefusedMerge {
  ReconstructionId other;
  std::string evidence;  // for a person
  // With the votes, of the reconstruction that the photo is in now. None where people forbid it.
  std::optional<HypothesisRecord> hypothesis;
};

struct MergeOutcome {
  ReconstructionId into;      // where the photo is now
  std::vector<Merge> merges;  // in the order in which they were made; empty where nothing merged
  std::vector<RefusedMerge> refused;
  std::vector<KnownSeam> known;  // neither made nor refused
};

// Merges the reconstructions that verified pairs of the `near` images and of the photo (`pairs`)
// lead to, wherever enough of their common points agree. Of the first two that merge, the one with
// more images keeps its frame; it is the one that is published longer. Further ones are merged into
// it. One that is a hypothesis with a large seam already, or since a split, is only judged where
// the request asks for it alone, or after another merge; otherwise it is told whether its seam has
// grown. Without fresh images there must be `near` ones, which lie in the request's reconstruction.
// Loads what it needs. Deterministic in its inputs and the seed.
Result<MergeOutcome> MergeAround(const MappingContext& context, const MergeRequest& request,
                                 std::span<const ImageId> near, std::span<const PairMatches> pairs,
                                 uint64_t seed);

// Says in the placement what was merged, refused and left as it is.
void NoteMerges(MergeOutcome outcome, Placement* placement);

// Merges all parts of a loop that has closed, without another judgment, unless people forbid that
// two of them are merged. Of `own` and the first part, the one with more images keeps its frame.
// Loads all parts. Deterministic in its inputs.
Result<MergeOutcome> MergeLoop(const MappingContext& context, ReconstructionId own,
                               const ClosedLoop& loop);

}  // namespace veduta
