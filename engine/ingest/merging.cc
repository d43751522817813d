// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/merging.h"

#include <set>

#include "engine/ingest/seam.h"
#include "engine/mapping/view_alignment.h"
#include "engine/query/forbidden.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Where a merge is sought: images of the photo's reconstruction, and the photo's pairs.
struct NearSeam {
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

// Merges `other` with the photo's reconstruction where the common points agree, and nothing else
// speaks against it.
Status TryMerge(const MappingContext& context, const MergeRequest& request,
                const NearSeam& near_seam, std::span<const PointPair> common,
                ReconstructionId other, uint64_t seed, MergeOutcome* outcome) {
  const MapperOptions& options = context.options;
  const auto by_points = AlignPoints(*context.map, common, options.merge_error_px_max,
                                     options.common_points_min, seed);
  VEDUTA_ASSIGN_OR_RETURN(const SeamImages seam,
                          FindSeam(context.loader, *context.map, request.fresh.front(),
                                   near_seam.pairs, near_seam.images, other));
  const CrossSightings seen = ListCrossSightings(*context.map, seam);
  std::optional<Sim3> found;
  if (by_points) {
    found = RefineSeam(seen, by_points->into_from);
  } else if (const auto by_views =
                 AlignByViews(seen.in_into, seen.in_other, seed, options.view_alignment)) {
    found = by_views->b_from_a;
  }
  if (!found) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const bool forbidden, IsForbidden(context, request, *outcome, other));
  if (forbidden) {
    outcome->refused.push_back({other, "somebody has forbidden that they are merged"});
    return Status::Ok();
  }
  const SeamEvidence evidence = JudgeSeam(*context.map, seam, *found, options);
  if (!evidence.Holds(options.doubt)) {
    outcome->refused.push_back({other, evidence.Text()});
    return Status::Ok();
  }
  Merge merge{other, *found, static_cast<uint32_t>(by_points ? by_points->agreeing.size() : 0),
              evidence.Text()};
  ReconstructionId into = outcome->into;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord other_record,
                          context.loader->GetReconstruction(other));
  VEDUTA_ASSIGN_OR_RETURN(const size_t own_count, CountOwn(context.loader, request));
  if (outcome->merges.empty() && other_record.image_count > own_count) {
    merge.from = into, merge.into_from = found->Inverse();
    into = other;
  }
  VEDUTA_RETURN_IF_ERROR(MoveAll(context, request, merge, into));
  for (const PointPair& pair : by_points ? by_points->agreeing : std::vector<PointPair>()) {
    TryMergePoints(context.map, pair.into, pair.from, options.growth.error_px_max);
  }
  for (const SeamPair& pair : seam.pairs)
    GrowFromMatches(context.map, pair.a, {&pair.matches, 1}, options.growth);
  outcome->into = into;
  outcome->merges.push_back(merge);
  return Status::Ok();
}

}  // namespace

Result<MergeOutcome> MergeAround(const MappingContext& context, const MergeRequest& request,
                                 std::span<const ImageId> near, std::span<const PairMatches> pairs,
                                 uint64_t seed) {
  MergeOutcome outcome;
  outcome.into = request.reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(const auto common, FindCommonPoints(context.loader, *context.map, near,
                                                              request.fresh.front(), pairs));
  for (auto [other, points] : common) {
    // An earlier merge may have made two points one.
    std::erase_if(points, [&](const PointPair& pair) {
      return !context.map->FindPoint(pair.into) || !context.map->FindPoint(pair.from);
    });
    VEDUTA_RETURN_IF_ERROR(TryMerge(context, request, {near, pairs}, points, other,
                                    MixSeed(seed, other.value), &outcome));
  }
  return outcome;
}

}  // namespace veduta
