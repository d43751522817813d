// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/merging.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "engine/ingest/far_apart.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/seam.h"
#include "engine/ingest/seam_loop.h"
#include "engine/mapping/view_alignment.h"
#include "engine/query/forbidden.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Where a merge is sought: images of the photo's reconstruction, and the photo's pairs.
struct NearSeam {
  ImageId photo;  // or one of the images, where no photo leads to the merge
  std::span<const ImageId> images;
  std::span<const PairMatches> pairs;
};

// How many images the photo's reconstruction has, with the fresh ones.
Result<size_t> CountOwn(MapLoader* loader, const MergeRequest& request) {
  if (request.is_new) return request.fresh.size();
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord own,
                          loader->GetReconstruction(request.reconstruction));
  return request.fresh.size() + own.image_count;
}

// Carries the images and points of `merge.from` over into `into`.
Status MoveAll(const MappingContext& context, const MergeRequest& request, const Merge& merge,
               ReconstructionId into) {
  std::vector<ImageId> members;
  if (!request.is_new || merge.from != request.reconstruction)
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadReconstruction(merge.from, &members));
  std::set<ImageId> moved(members.begin(), members.end());
  for (const ImageId id : request.fresh) {
    if (context.map->image(id).reconstruction == merge.from) moved.insert(id);
  }
  for (const ImageId id : moved) {
    context.map->MoveImage(id, into, merge.into_from);
    context.map->MoveBlock(id, into, merge.into_from);
  }
  return Status::Ok();
}

// Whether somebody has forbidden to join `other` with what the photo's reconstruction is by now.
Result<bool> IsForbidden(const MappingContext& context, const MergeRequest& request,
                         const MergeOutcome& outcome, ReconstructionId other) {
  std::set<ReconstructionId> joined = {request.reconstruction, outcome.into};
  for (const Merge& merge : outcome.merges) joined.insert(merge.from);
  for (const ReconstructionId id : joined) {
    VEDUTA_ASSIGN_OR_RETURN(const bool forbidden,
                            IsMergeForbidden(context.loader->snapshot(), id, other));
    if (forbidden) return true;
  }
  return false;
}

struct Proposal {
  Sim3 into_from;
  std::vector<PointPair> agreeing;
  bool is_exact = true;  // else only a loop can confirm it
};

// The similarity that the common points propose or, where there are too few, what the cameras of
// one side see of the other's points; then without common points.
std::optional<Proposal> Propose(const CityMap& map, const SeamArea& seam,
                                std::span<const PointPair> common, uint64_t seed,
                                const MapperOptions& options) {
  const CrossSightings seen = ListCrossSightings(map, seam);
  if (auto by_points =
          AlignPoints(map, common, options.merge_error_px_max, options.common_points_min, seed)) {
    return Proposal{RefineSeam(seen, by_points->into_from), std::move(by_points->agreeing)};
  }
  const ViewAlignmentOptions& exact = options.view_alignment;
  const auto by_views = AlignByViews(seen.in_into, seen.in_other, seed, LooseAlignment(options));
  if (!by_views) return std::nullopt;
  return Proposal{by_views->b_from_a,
                  {},
                  by_views->of_others >= exact.other_sightings_min &&
                      by_views->log_scale_deviation <= exact.log_scale_deviation_max};
}

// Whether a pair of the seam is so strong that the seam is remembered though nothing proposes a
// similarity.
bool IsWorthRemembering(const SeamArea& seam, const LoopOptions& options) {
  return std::ranges::any_of(seam.pairs, [&](const SeamPair& pair) {
    return pair.matches.geometry == PairGeometry::kGeneral &&
           pair.matches.matches.size() >= options.matches_min;
  });
}

// Why the two are not believed to be one by what is proposed; nothing where they are. `text`
// receives what speaks for and against it. `far_m`: by how much they are told to be apart on the
// earth; then only a loop can confirm it.
std::optional<RefusedMerge> Refuse(const CityMap& map, const SeamArea& seam, ReconstructionId own,
                                   ReconstructionId other, const std::optional<Proposal>& proposal,
                                   const std::optional<double>& far_m, const MapperOptions& options,
                                   std::string* text) {
  SeamEvidence evidence;
  RefusalReason reason = RefusalReason::kOpen;
  if (proposal) {
    evidence = JudgeSeam(map, seam, proposal->into_from, options);
    *text = evidence.Text();
    const std::optional<RefusalReason> refusal = evidence.Refusal(options.doubt);
    if (!refusal && proposal->is_exact && !far_m) return std::nullopt;
    reason = refusal.value_or(far_m ? RefusalReason::kFarApart : RefusalReason::kUndetermined);
    if (far_m) {
      *text += "; their places on the earth are " + std::to_string(std::lround(*far_m)) +
               " m from each other";
    }
  }
  Sim3 own_from_other = proposal ? proposal->into_from : Sim3();
  if (proposal && !proposal->is_exact && !MayCloseLoop(reason)) {
    // A similarity that is known badly explains badly, which speaks against the similarity alone.
    evidence = {}, own_from_other = {}, reason = RefusalReason::kOpen;
  }
  if (reason == RefusalReason::kOpen)
    *text = "pairs of photos lead there and do not say how the two lie to each other";
  HypothesisRecord hypothesis = HypothesisOf(own, other, own_from_other, evidence, reason);
  if (proposal) hypothesis.common_point_count = static_cast<uint32_t>(proposal->agreeing.size());
  hypothesis.images = SeamImages(seam.pairs);
  return RefusedMerge{other, *text, std::move(hypothesis)};
}

// A seam of so many cells is not judged with each photo, which would make photos near it slow. On a
// street of 150 a right merge of 202 cells depended on being judged with each photo. Chosen by
// hand; not measured.
constexpr uint32_t kLargeSeamCells = 300;

// A seam where so many pairs contradict the merge, and so many times those that agree: a few more
// change nothing. Among fronts that are all alike nearly every two reconstructions have one. Chosen
// by hand: where 4 contradicted a right merge on castle-P19, 6 agreed.
constexpr uint32_t kRefutingPairsMin = 6, kRefutingFactor = 3;

bool IsRefuted(const HypothesisRecord& known) {
  return known.contradicting_pairs >= kRefutingPairsMin &&
         known.contradicting_pairs > kRefutingFactor * known.agreeing_pairs;
}

// Whether the merge is a hypothesis that is not judged with each photo, but by a step of its own:
// its seam is large, or pairs refute it, or a split has left it, and merging and splitting might
// never end. Then it is noted whether its seam has grown so much that the step is due: by one pair
// at least, and by a quarter. The quarter was chosen by hand; not measured.
Result<bool> NoteKnown(const MappingContext& context, const NearSeam& near_seam,
                       ReconstructionId other, MergeOutcome* outcome) {
  const auto [a, b] = std::minmax(outcome->into, other);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all,
                          context.loader->snapshot().ListHypotheses());
  const auto known = std::ranges::find_if(
      all, [&, a = a, b = b](const HypothesisRecord& h) { return h.a == a && h.b == b; });
  if (known == all.end()) return false;
  if (known->judged_cells < kLargeSeamCells && known->reason != RefusalReason::kSplit &&
      !IsRefuted(*known))
    return false;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SeamPair> pairs,
                          ListSeamPairs(context.loader, *context.map, near_seam.photo,
                                        near_seam.pairs, near_seam.images, other));
  const size_t before = known->agreeing_pairs + known->contradicting_pairs;
  const size_t now = static_cast<size_t>(std::ranges::count_if(pairs, [](const SeamPair& pair) {
    return pair.matches.geometry != PairGeometry::kRotation;  // which JudgeSeam does not ask
  }));
  outcome->known.push_back({outcome->into, other, 4 * now >= 5 * before + 1, known->reason});
  return true;
}

// Merges `other` with the photo's reconstruction where the common points agree, and nothing else
// speaks against it.
Status TryMerge(const MappingContext& context, const MergeRequest& request,
                const NearSeam& near_seam, std::span<const PointPair> common,
                ReconstructionId other, uint64_t seed, MergeOutcome* outcome) {
  const MapperOptions& options = context.options;
  if (!request.only.valid() && outcome->merges.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(const bool is_known, NoteKnown(context, near_seam, other, outcome));
    if (is_known) return Status::Ok();
  }
  VEDUTA_ASSIGN_OR_RETURN(const SeamArea seam,
                          FindSeam(context.loader, *context.map, near_seam.photo, near_seam.pairs,
                                   near_seam.images, other));
  const std::optional<Proposal> proposal = Propose(*context.map, seam, common, seed, options);
  const bool is_worth_remembering = IsWorthRemembering(seam, options.loop);
  if (!proposal && !is_worth_remembering) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const bool forbidden, IsForbidden(context, request, *outcome, other));
  if (forbidden) {
    outcome->refused.push_back({other, "somebody has forbidden that they are merged", {}});
    return Status::Ok();
  }
  std::optional<double> far_m;
  if (proposal) {
    VEDUTA_ASSIGN_OR_RETURN(far_m, FindFarApart(context.loader->snapshot(), *context.map, seam,
                                                outcome->into, other, proposal->into_from));
  }
  std::string evidence;
  if (auto refused =
          Refuse(*context.map, seam, outcome->into, other, proposal, far_m, options, &evidence)) {
    if (refused->hypothesis->reason == RefusalReason::kOpen && !is_worth_remembering)
      return Status::Ok();
    if (!request.fresh.empty()) refused->hypothesis->image = request.fresh.front();
    outcome->refused.push_back(std::move(*refused));
    return Status::Ok();
  }
  Merge merge{other, proposal->into_from, static_cast<uint32_t>(proposal->agreeing.size()),
              std::move(evidence)};
  ReconstructionId into = outcome->into;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord other_record,
                          context.loader->GetReconstruction(other));
  VEDUTA_ASSIGN_OR_RETURN(const size_t own_count, CountOwn(context.loader, request));
  if (outcome->merges.empty() && other_record.image_count > own_count) {
    merge.from = into, merge.into_from = merge.into_from.Inverse();
    into = other;
    for (RefusedMerge& refused : outcome->refused) {
      if (refused.hypothesis) GoOver(merge, into, &*refused.hypothesis);
    }
  }
  VEDUTA_RETURN_IF_ERROR(MoveAll(context, request, merge, into));
  for (const PointPair& pair : proposal->agreeing) {
    TryMergePoints(context.map, pair.into, pair.from, options.growth.error_px_max);
  }
  for (const SeamPair& pair : seam.pairs)
    GrowFromMatches(context.map, pair.a, {&pair.matches, 1}, options.growth);
  outcome->into = into;
  outcome->merges.push_back(merge);
  return Status::Ok();
}

// What two parts of a loop have in common, while they are apart.
struct Common {
  std::vector<SeamPair> pairs;
  std::vector<PointPair> points;
};

Result<Common> FindCommon(const MappingContext& context, const LoopSeam& seam) {
  Common common;
  VEDUTA_ASSIGN_OR_RETURN(common.pairs, ListSeamPairs(context.loader, *context.map,
                                                      seam.near.front(), {}, seam.near, seam.b));
  std::vector<ImageId> growing;
  for (const SeamPair& pair : common.pairs)
    growing.insert(growing.end(), {pair.a, pair.matches.other});
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(growing));
  VEDUTA_ASSIGN_OR_RETURN(auto points, FindCommonPoints(context.loader, *context.map, seam.near,
                                                        seam.near.front(), {}));
  common.points = std::move(points[seam.b]);
  return common;
}

// Whether somebody has forbidden to join two parts of the loop.
Result<bool> IsForbidden(const Snapshot& snapshot, ReconstructionId own, const ClosedLoop& loop) {
  std::vector<ReconstructionId> ids = {own};
  for (const LoopPart& part : loop.parts) ids.push_back(part.id);
  for (size_t i = 0; i < ids.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      VEDUTA_ASSIGN_OR_RETURN(const bool forbidden, IsMergeForbidden(snapshot, ids[i], ids[j]));
      if (forbidden) return true;
    }
  }
  return false;
}

// The largest is first, for only the first merge decides whose frame stays, and then the others
// ascending.
Result<std::vector<ReconstructionId>> LargestFirst(
    MapLoader* loader, const std::map<ReconstructionId, std::vector<PointPair>>& common) {
  std::vector<ReconstructionId> ids;
  size_t largest = 0;
  uint32_t most = 0;
  for (const auto& [id, points] : common) {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, loader->GetReconstruction(id));
    if (record.image_count > most) most = record.image_count, largest = ids.size();
    ids.push_back(id);
  }
  if (!ids.empty()) std::rotate(ids.begin(), ids.begin() + largest, ids.begin() + largest + 1);
  return ids;
}

}  // namespace

Result<MergeOutcome> MergeLoop(const MappingContext& context, ReconstructionId own,
                               const ClosedLoop& loop) {
  MergeOutcome outcome{own, {}, {}, {}};
  VEDUTA_ASSIGN_OR_RETURN(const bool forbidden, IsForbidden(context.loader->snapshot(), own, loop));
  if (forbidden) return outcome;
  std::vector<Common> commons;
  for (const LoopSeam& seam : loop.seams) {
    VEDUTA_ASSIGN_OR_RETURN(Common common, FindCommon(context, seam));
    commons.push_back(std::move(common));
  }
  std::vector<LoopPart> parts = loop.parts;
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord largest, context.loader->GetReconstruction(own));
  Sim3 into_from_own;
  LoopPart* replaced = nullptr;
  for (LoopPart& part : parts) {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                            context.loader->GetReconstruction(part.id));
    if (record.image_count > largest.image_count) largest = record, replaced = &part;
  }
  if (replaced != nullptr) {
    outcome.into = largest.id;
    into_from_own = replaced->own_from_part.Inverse();
    *replaced = {own, {}};
  }
  for (const LoopPart& part : parts) {
    outcome.merges.push_back({part.id, into_from_own * part.own_from_part, 0, loop.evidence});
    VEDUTA_RETURN_IF_ERROR(MoveAll(context, {own, false, {}}, outcome.merges.back(), outcome.into));
  }
  const MapperOptions& options = context.options;
  for (const Common& common : commons) {
    for (const PointPair& pair : common.points) {
      if (context.map->FindPoint(pair.into) && context.map->FindPoint(pair.from))
        TryMergePoints(context.map, pair.into, pair.from, options.growth.error_px_max);
    }
    for (const SeamPair& pair : common.pairs)
      GrowFromMatches(context.map, pair.a, {&pair.matches, 1}, options.growth);
  }
  return outcome;
}

Result<MergeOutcome> MergeAround(const MappingContext& context, const MergeRequest& request,
                                 std::span<const ImageId> near, std::span<const PairMatches> pairs,
                                 uint64_t seed) {
  MergeOutcome outcome;
  outcome.into = request.reconstruction;
  VEDUTA_CHECK(!request.fresh.empty() || !near.empty(), "a merge is sought around no image");
  const ImageId photo = request.fresh.empty() ? near.front() : request.fresh.front();
  VEDUTA_ASSIGN_OR_RETURN(auto common,
                          FindCommonPoints(context.loader, *context.map, near, photo, pairs));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionId> others,
                          LargestFirst(context.loader, common));
  for (const ReconstructionId other : others) {
    if (request.only.valid() && other != request.only) continue;
    std::vector<PointPair>& points = common.at(other);
    // An earlier merge may have made two points one.
    std::erase_if(points, [&](const PointPair& pair) {
      return !context.map->FindPoint(pair.into) || !context.map->FindPoint(pair.from);
    });
    VEDUTA_RETURN_IF_ERROR(TryMerge(context, request, {photo, near, pairs}, points, other,
                                    MixSeed(seed, other.value), &outcome));
  }
  return outcome;
}

void NoteMerges(MergeOutcome outcome, Placement* placement) {
  for (const Merge& merge : outcome.merges) {
    placement->verdict = Verdict::kMerged;
    placement->reason = Reason::kJoinedReconstructions;
    placement->detail += "; reconstructions " + std::to_string(merge.from.value) + " and " +
                         std::to_string(outcome.into.value) + " merged by " +
                         (merge.common_point_count > 0
                              ? std::to_string(merge.common_point_count) + " common points ("
                              : "what the photos of one see of the other (") +
                         merge.evidence + ")";
  }
  for (RefusedMerge& refused : outcome.refused) {
    placement->detail += "; not merged with reconstruction " + std::to_string(refused.other.value) +
                         ": " + refused.evidence;
    if (refused.hypothesis) placement->refused.push_back(std::move(*refused.hypothesis));
  }
  placement->known = std::move(outcome.known);
  placement->reconstruction = outcome.into;
  placement->merges = std::move(outcome.merges);
}

}  // namespace veduta
