// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/judging.h"

#include <algorithm>

#include "engine/ingest/hypotheses.h"
#include "engine/ingest/merging.h"
#include "engine/ingest/placement_writer.h"
#include "engine/ingest/seam.h"
#include "engine/ingest/surroundings.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Distinguishes the seed from those of placing the same photo. Any number would do.
constexpr uint64_t kSeedOfJudgments = 2;

// The side of a seam that the merge is sought from.
struct Side {
  ReconstructionId own, other;
  std::vector<ImageId> near;  // images at the seam that lie in `own`; ascending
  Sim3 own_from_other;
};

Result<HypothesisRecord> FindHypothesis(const Snapshot& base, ReconstructionId a,
                                        ReconstructionId b) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, base.ListHypotheses());
  for (const HypothesisRecord& hypothesis : all) {
    if (hypothesis.a == a && hypothesis.b == b) return hypothesis;
  }
  return Status::NotFound("there is no hypothesis that reconstructions " + std::to_string(a.value) +
                          " and " + std::to_string(b.value) + " are one");
}

// The first of the two that has an image at the seam; `near` is empty where neither has.
Result<Side> FindSide(const Snapshot& base, const HypothesisRecord& hypothesis) {
  Side a{hypothesis.a, hypothesis.b, {}, hypothesis.a_from_b};
  Side b{hypothesis.b, hypothesis.a, {}, hypothesis.a_from_b.Inverse()};
  for (const ImageId image : hypothesis.images) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, base.FindPose(image));
    for (Side* const side : {&a, &b}) {
      if (pose && pose->reconstruction == side->own) side->near.push_back(image);
    }
  }
  return a.near.empty() ? b : a;
}

// The votes for the similarity that was proposed before, where neither common points nor what the
// cameras see across give a better one.
Result<std::optional<HypothesisRecord>> JudgeAsBefore(const MappingContext& context,
                                                      const Side& side) {
  VEDUTA_ASSIGN_OR_RETURN(
      const SeamArea seam,
      FindSeam(context.loader, *context.map, side.near.front(), {}, side.near, side.other));
  if (seam.pairs.empty()) return std::optional<HypothesisRecord>();
  HypothesisRecord judged =
      HypothesisOf(side.own, side.other, side.own_from_other,
                   JudgeSeam(*context.map, seam, side.own_from_other, context.options),
                   RefusalReason::kFewPoints);
  judged.images = SeamImages(seam.pairs);
  return std::optional(std::move(judged));
}

// The judgment as a placement that places nothing. It has neither merged nor refused anything where
// there is nothing left to judge.
Result<Placement> Judge(const MappingContext& context, const Side& side) {
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(side.near));
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord first,
                          context.loader->snapshot().GetImage(side.near.front()));
  const MergeRequest request{side.own, false, {}, side.other};
  VEDUTA_ASSIGN_OR_RETURN(
      MergeOutcome outcome,
      MergeAround(context, request, side.near, {}, MixSeed(first.photo.Seed(), kSeedOfJudgments)));
  Placement placement;
  placement.verdict = Verdict::kMerged;
  placement.reconstruction = outcome.into;
  placement.merges = std::move(outcome.merges);
  for (RefusedMerge& refused : outcome.refused) {
    if (refused.hypothesis) placement.refused.push_back(std::move(*refused.hypothesis));
  }
  if (!placement.merges.empty()) {
    VEDUTA_RETURN_IF_ERROR(
        AdjustAround(context, side.near.front(), context.options.local_images_max));
    return placement;
  }
  if (!outcome.refused.empty()) return placement;
  VEDUTA_ASSIGN_OR_RETURN(std::optional<HypothesisRecord> as_before, JudgeAsBefore(context, side));
  if (as_before) placement.refused.push_back(std::move(*as_before));
  return placement;
}

}  // namespace

Result<ReconstructionId> JudgeAnew(const IngestParts& parts, ReconstructionId a, ReconstructionId b,
                                   WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(const HypothesisRecord hypothesis, FindHypothesis(*scope.base, a, b));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  VEDUTA_ASSIGN_OR_RETURN(const Side side, FindSide(*scope.base, hypothesis));
  Transaction* const transaction = scope.transaction.get();
  parts.TrimMap();
  Placement placement;
  if (!side.near.empty()) {
    MapLoader loader(scope.base, parts.features, parts.map);
    VEDUTA_ASSIGN_OR_RETURN(placement,
                            Judge({&loader, parts.map, parts.pool, parts.options.mapper}, side));
  }
  if (!placement.merges.empty()) {
    VEDUTA_RETURN_IF_ERROR(WritePlacement(*parts.map, *scope.base, placement, &state, transaction));
  } else if (!placement.refused.empty()) {
    VEDUTA_RETURN_IF_ERROR(WriteHypotheses(*scope.base, placement, &state, transaction));
  } else {
    transaction->DeleteHypothesis(a, b);
  }
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  return placement.merges.empty() ? ReconstructionId() : placement.reconstruction;
}

}  // namespace veduta
