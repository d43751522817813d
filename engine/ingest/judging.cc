// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/judging.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "engine/ingest/dense_removal.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/local_unplacing.h"
#include "engine/ingest/merging.h"
#include "engine/ingest/misplaced.h"
#include "engine/ingest/mixed_places.h"
#include "engine/ingest/placement_writer.h"
#include "engine/ingest/region_writer.h"
#include "engine/ingest/seam.h"
#include "engine/ingest/seam_loop.h"
#include "engine/ingest/submaps.h"
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
  bool is_open = false;  // the similarity means nothing
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

// The first of the two sides that has an image at the seam; `near` is empty where neither has one.
Result<Side> FindSide(const Snapshot& base, const HypothesisRecord& hypothesis) {
  const bool is_open = hypothesis.reason == RefusalReason::kOpen;
  Side a{hypothesis.a, hypothesis.b, {}, hypothesis.a_from_b, is_open};
  Side b{hypothesis.b, hypothesis.a, {}, hypothesis.a_from_b.Inverse(), is_open};
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

// The judgment in the form of a placement that places nothing. It holds neither a merge nor a
// refusal where there is nothing left to judge.
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
  if (side.is_open) return placement;
  VEDUTA_ASSIGN_OR_RETURN(std::optional<HypothesisRecord> as_before, JudgeAsBefore(context, side));
  if (as_before) placement.refused.push_back(std::move(*as_before));
  return placement;
}

// Where the judgment leaves it open and a loop closes at the seam, all of the loop is merged.
Result<Placement> JudgeByLoop(const MappingContext& context, const Side& side,
                              std::span<const HypothesisRecord> all, Placement judged) {
  if (judged.refused.empty() || !MayCloseLoop(judged.refused.front())) return judged;
  const HypothesisRecord& refused = judged.refused.front();
  OpenSeam open{side.own, side.other, side.near};
  if (!MayCloseLoop(refused.reason)) {
    open.refuted_own_from_other =
        refused.a == side.own ? refused.a_from_b : refused.a_from_b.Inverse();
  }
  const std::vector<HypothesisRecord> detour = Detours(all).Find(side.own, side.other);
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ClosedLoop> closed, CloseLoop(context, open, detour));
  if (!closed) return judged;
  VEDUTA_ASSIGN_OR_RETURN(MergeOutcome outcome, MergeLoop(context, side.own, *closed));
  if (outcome.merges.empty()) return judged;
  Placement placement;
  placement.verdict = Verdict::kMerged;
  placement.reconstruction = outcome.into;
  placement.merges = std::move(outcome.merges);
  VEDUTA_RETURN_IF_ERROR(
      AdjustAround(context, side.near.front(), context.options.local_images_max));
  return placement;
}

// Whether nothing has judged the seam since an adjustment has split the two there.
bool IsJustSplit(const HypothesisRecord& hypothesis) {
  return hypothesis.reason == RefusalReason::kSplit && hypothesis.judgment_count == 1;
}

// The judgment by all that there is; nothing where no image is at the seam. What has just been
// split stays so, and it is only asked whether all images went to the right side.
Result<Placement> JudgeFrom(const MappingContext& context, const Side& side,
                            const HypothesisRecord& hypothesis) {
  Placement as_it_is;
  if (side.near.empty()) return as_it_is;
  if (IsJustSplit(hypothesis)) {
    as_it_is.refused.push_back(hypothesis);
    return as_it_is;
  }
  VEDUTA_ASSIGN_OR_RETURN(Placement judged, Judge(context, side));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all,
                          context.loader->snapshot().ListHypotheses());
  return JudgeByLoop(context, side, all, std::move(judged));
}

std::vector<ImageId> Union(const std::vector<ImageId>& a, const std::vector<ImageId>& b) {
  std::vector<ImageId> both;
  std::ranges::set_union(a, b, std::back_inserter(both));
  return both;
}

// Images that are weighed one by one: those at the seam, and with them those that are unsure,
// unless these are a large place. A judgment would take minutes then, after nearly each photo.
std::vector<ImageId> ToWeigh(const HypothesisRecord& seam, const std::vector<ImageId>& unsure) {
  constexpr size_t kUnsureMax = 64;  // as many as are compared at once (mixed_places.h)
  return unsure.size() <= kUnsureMax ? Union(seam.images, unsure) : seam.images;
}

// What is to be said against the sides on which these images stand. None is called unsure where
// evidence is merely missing: what lies at the border of two parts of one place fits both. There,
// and only there, an image goes where most of its matches lead: twins match each other, too.
Result<SideDoubts> WeighSeam(const MappingContext& context, const Side& side,
                             const HypothesisRecord& refused, std::span<const ImageId> images) {
  const bool is_torn = IsJustSplit(refused) && refused.contradicting_pairs > refused.agreeing_pairs;
  const bool is_contradicted = TellsPlacesApart(refused.reason);
  const bool lacks =
      is_torn || refused.missing_cells >= context.options.doubt.better_missing_cells_min;
  SideDoubts doubts;
  if (!is_contradicted && !lacks) {
    for (const auto& [own, other] : {std::pair(side.own, side.other), {side.other, side.own}}) {
      if (!doubts.misplaced.empty()) break;
      VEDUTA_ASSIGN_OR_RETURN(doubts.misplaced, FindOutweighed(context, images, own, other));
    }
    return doubts;
  }
  VEDUTA_ASSIGN_OR_RETURN(doubts, WeighSides(context, images, side.own, side.other));
  VEDUTA_ASSIGN_OR_RETURN(SideDoubts others, WeighSides(context, images, side.other, side.own));
  // Those of one side at a time lose their poses; those of the other one are unsure meanwhile.
  if (doubts.misplaced.empty()) std::swap(doubts.misplaced, others.misplaced);
  doubts.unsure.insert(doubts.unsure.end(), others.unsure.begin(), others.unsure.end());
  for (const DoubtedImage& image : others.misplaced) doubts.unsure.push_back(image.image);
  if (!lacks) doubts.misplaced.clear();
  if (!is_contradicted) doubts.unsure.clear();
  return doubts;
}

// An image that was doubted since the last fifth of the photos came keeps its pose: it stands there
// again, as it may among places that look alike, and placing and doubting it in turn would never
// end. It is not sure of it. The fifth was chosen by hand; not measured.
Status KeepDoubted(const Snapshot& base, const DatabaseState& state, SideDoubts* doubts) {
  if (doubts->misplaced.empty()) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(
      const std::set<ImageId> doubted,
      AlreadyDoubted(base, state.next_journal, state.retrievable_image_count / 5));
  std::erase_if(doubts->misplaced, [&](const DoubtedImage& one) {
    if (!doubted.contains(one.image)) return false;
    doubts->unsure.push_back(one.image);
    return true;
  });
  return Status::Ok();
}

// Takes the poses of the misplaced images, and of the images that too few points hold without them.
// All of them are tried again at once.
Result<std::vector<LostPose>> Unplace(const IngestParts& parts, MapLoader* loader,
                                      std::span<const DoubtedImage> misplaced,
                                      const WriteScope& scope, DatabaseState* state) {
  std::vector<ImageId> images;
  for (const DoubtedImage& image : misplaced) images.push_back(image.image);
  const ReconstructionId from = parts.map->image(images.front()).reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(
      const std::vector<ImageId> dependent,
      UnplaceWithDependents(images, parts.options.mapper.observations_min, loader, parts.map));
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord whole, loader->GetReconstruction(from));
  VEDUTA_RETURN_IF_ERROR(WriteChangedLocally(*parts.map, *scope.base, transaction));
  if (parts.map->changes().unplaced.size() == whole.image_count)
    VEDUTA_RETURN_IF_ERROR(DropHypotheses(*scope.base, from, transaction));
  std::vector<LostPose> lost;
  for (const DoubtedImage& image : misplaced) lost.push_back({image.image, image.why});
  for (const ImageId image : dependent)
    lost.push_back({image, "too few points hold it without those that were misplaced"});
  std::ranges::sort(lost, {}, &LostPose::image);
  images.insert(images.end(), dependent.begin(), dependent.end());
  VEDUTA_RETURN_IF_ERROR(RemoveFromDense(*scope.base, images, transaction).status());
  for (LostPose& image : lost) {
    image.detail = "in reconstruction " + std::to_string(from.value) + ", " + image.detail;
    VEDUTA_RETURN_IF_ERROR(
        PostponeImages(*scope.base, {&image.image, 1}, from, image.detail, state, transaction));
  }
  return lost;
}

constexpr size_t kImagesMin = 3;  // of a reconstruction

// A part of a reconstruction that shows another place than the rest of it.
struct OtherPlace {
  ReconstructionId in;
  std::vector<ImageId> images;  // ascending; empty where there is none
};

// Parts that are split off between two actions of people, at most, and parts that have come back to
// the reconstruction while the last fifth of the photos came: parting and merging in turn would
// never end. Chosen by hand; not measured.
constexpr size_t kSplitsMax = 4, kUndoneSplitsMax = 2;

// Those of the last fifth of the photos.
Result<std::vector<ReconstructionId>> ListLateSplits(const Snapshot& base,
                                                     const DatabaseState& state) {
  return ListSplitOff(base, state.next_journal, state.retrievable_image_count / 5);
}

Result<bool> MaySplit(const Snapshot& base, const DatabaseState& state, ReconstructionId from) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionId> now,
                          ListSplitOff(base, state.next_journal));
  if (now.size() >= kSplitsMax) return false;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionId> late, ListLateSplits(base, state));
  VEDUTA_ASSIGN_OR_RETURN(const size_t undone, CountMergedInto(base, late, from));
  return undone < kUndoneSplitsMax;
}

// Whether the two stay apart until more photos have come: one of them was split off, as were parts
// before it that a judgment took back. An adjustment and a judgment may disagree, and apart is
// better than wrong.
Result<bool> WouldGoRound(const Snapshot& base, const DatabaseState& state,
                          const HypothesisRecord& hypothesis) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionId> late, ListLateSplits(base, state));
  const auto is_late = [&](ReconstructionId id) { return std::ranges::count(late, id) > 0; };
  if (!is_late(hypothesis.a) && !is_late(hypothesis.b)) return false;
  VEDUTA_ASSIGN_OR_RETURN(const size_t into_a, CountMergedInto(base, late, hypothesis.a));
  VEDUTA_ASSIGN_OR_RETURN(const size_t into_b, CountMergedInto(base, late, hypothesis.b));
  return into_a + into_b >= kUndoneSplitsMax;
}

// Whether one of the two sides of a seam that the pictures refute shows two places, as where photos
// of the other side took it for theirs.
Result<OtherPlace> FindMixed(const MappingContext& context, const Side& side,
                             const HypothesisRecord& refused) {
  const OtherPlace none;
  if (refused.reason != RefusalReason::kMissingStructure) return none;
  VEDUTA_ASSIGN_OR_RETURN(
      const SeamArea seam,
      FindSeam(context.loader, *context.map, side.near.front(), {}, side.near, side.other));
  for (const bool is_own : {true, false}) {
    OtherPlace place{is_own ? side.own : side.other, {}};
    VEDUTA_ASSIGN_OR_RETURN(place.images, FindOtherPlace(context, is_own ? seam.into : seam.other));
    if (place.images.size() >= kImagesMin) return place;
  }
  return none;
}

// Splits the other place off, and commits. What is left is adjusted anew: the whole, or where it is
// parted into submaps those around what was split off, which TakeOutOfRegion makes due.
Result<AdjustedWhole> SplitOff(const IngestParts& parts, const OtherPlace& place, WriteScope scope,
                               DatabaseState* state) {
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record, scope.base->GetReconstruction(place.in));
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(*scope.base));
  if (!submaps.IsParted(place.in)) record.images_at_adjustment = 0;
  Healing healing;
  healing.parts.push_back(place.images);
  // Lives until the commit has come, for it holds what is written ahead.
  HealingWriter writer(parts, scope, place.in, state);
  VEDUTA_RETURN_IF_ERROR(
      TakeOutOfRegion(parts, scope, std::move(record), healing, &writer, &submaps));
  submaps.Write(scope.transaction.get());
  scope.transaction->PutState(*state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  parts.map->ClearChanges();
  return writer.adjusted();
}

}  // namespace

Result<Judgment> JudgeAnew(const IngestParts& parts, ReconstructionId a, ReconstructionId b,
                           WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(HypothesisRecord hypothesis, FindHypothesis(*scope.base, a, b));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  VEDUTA_ASSIGN_OR_RETURN(const Side side, FindSide(*scope.base, hypothesis));
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(const bool would_go_round, WouldGoRound(*scope.base, state, hypothesis));
  if (would_go_round && !IsJustSplit(hypothesis)) {
    hypothesis.is_due = false;
    transaction->PutHypothesis(hypothesis);
    VEDUTA_RETURN_IF_ERROR(transaction->Commit());
    return Judgment();
  }
  parts.TrimMap();
  MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
  VEDUTA_ASSIGN_OR_RETURN(
      Placement placement,
      JudgeFrom({&loader, parts.map, parts.pool, parts.options.mapper}, side, hypothesis));
  Judgment judgment;
  if (!placement.merges.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(*scope.base));
    // The submaps on both sides know nothing of the seam yet.
    if (submaps.IsParted(a) || submaps.IsParted(b)) placement.around = hypothesis.images;
    VEDUTA_RETURN_IF_ERROR(
        WritePlacement(*parts.map, *scope.base, placement, {}, &state, transaction));
    judgment.merged_into = placement.reconstruction;
  } else if (!placement.refused.empty()) {
    HypothesisRecord& refused = placement.refused.front();
    VEDUTA_ASSIGN_OR_RETURN(
        const OtherPlace place,
        FindMixed({&loader, parts.map, parts.pool, parts.options.mapper}, side, refused));
    VEDUTA_ASSIGN_OR_RETURN(const bool may_split, place.images.empty()
                                                      ? Result<bool>(false)
                                                      : MaySplit(*scope.base, state, place.in));
    if (may_split) {
      VEDUTA_ASSIGN_OR_RETURN(judgment.taken_out, SplitOff(parts, place, std::move(scope), &state));
      return judgment;
    }
    // A search from one side need not lead to all that was at the seam before.
    VEDUTA_ASSIGN_OR_RETURN(SideDoubts doubts,
                            WeighSeam({&loader, parts.map, parts.pool, parts.options.mapper}, side,
                                      refused, ToWeigh(refused, hypothesis.unsure)));
    VEDUTA_RETURN_IF_ERROR(KeepDoubted(*scope.base, state, &doubts));
    std::ranges::sort(doubts.unsure);
    // A place that may not be split off now is not told where it stands.
    refused.unsure = Union(doubts.unsure, place.images);
    refused.images = ToWeigh(refused, refused.unsure);
    VEDUTA_RETURN_IF_ERROR(WriteHypotheses(*scope.base, placement, &state, transaction));
    if (!doubts.misplaced.empty()) {
      VEDUTA_ASSIGN_OR_RETURN(judgment.taken_out.unplaced,
                              Unplace(parts, &loader, doubts.misplaced, scope, &state));
    }
  } else {
    transaction->DeleteHypothesis(a, b);
  }
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  return judgment;
}

}  // namespace veduta
