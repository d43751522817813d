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

namespace veduta {

// A seam that is believed without another judgment.
struct BelievedSeam {
  Sim3 own_from_other;
  std::string evidence;  // for a person
};

// The reconstruction that a photo has just got a pose in.
struct MergeRequest {
  ReconstructionId reconstruction;
  bool is_new = false;  // it was founded with the photo and is not stored yet
  // Images that have just got a pose, the photo first; none where no photo leads to the merge.
  std::span<const ImageId> fresh;
  ReconstructionId only = {};  // where valid, no other one is merged
  // Where there is one, `only` is merged by this similarity, which is believed already.
  std::optional<BelievedSeam> believed = {};
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

}  // namespace veduta
