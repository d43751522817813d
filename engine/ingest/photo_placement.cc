// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/photo_placement.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "engine/ingest/believed_pose.h"
#include "engine/ingest/doubt.h"
#include "engine/ingest/forbidding.h"
#include "engine/ingest/merging.h"
#include "engine/ingest/misplaced.h"
#include "engine/ingest/reconstruction_start.h"
#include "engine/ingest/submaps.h"
#include "engine/ingest/surroundings.h"
#include "engine/mapping/agreeing_growth.h"
#include "engine/mapping/better_pose.h"
#include "engine/query/forbidden.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// What one photo is placed by.
struct PhotoAtHand {
  const ImageFeatures& photo;
  std::span<const PairMatches> pairs;     // verified
  std::span<const PairMatches> putative;  // with placed images, right or wrong
  uint64_t seed;
};

Status MergeWhatItJoins(const MappingContext& context, const PhotoAtHand& at_hand,
                        std::span<const ImageId> near, Placement* placement) {
  const MergeRequest request{
      placement->reconstruction, placement->founded.valid(), placement->placed, {}};
  VEDUTA_ASSIGN_OR_RETURN(MergeOutcome merged,
                          MergeAround(context, request, near, at_hand.pairs, at_hand.seed));
  NoteMerges(std::move(merged), placement);
  placement->around = placement->placed;
  placement->around.insert(placement->around.end(), near.begin(), near.end());
  for (const PairMatches& pair : at_hand.pairs) placement->around.push_back(pair.other);
  return Status::Ok();
}

// The third case. Changes `placement` where a reconstruction is founded, and says why none was
// where no other reason is known.
Status TryToFound(const MappingContext& context, const PhotoAtHand& at_hand, ReconstructionId id,
                  Placement* placement) {
  VEDUTA_ASSIGN_OR_RETURN(
      ReconstructionStart start,
      StartReconstruction(context, at_hand.photo, at_hand.pairs, id, at_hand.seed));
  if (start.outcome != FoundingOutcome::kFounded) {
    if (placement->reason != Reason::kNone) return Status::Ok();
    placement->reason = Reason::kNoGoodTriple;
    placement->detail = NoStartDetail(start, at_hand.pairs.size());
    return Status::Ok();
  }
  placement->verdict = Verdict::kFounded;
  placement->reason = Reason::kGoodTriple;
  placement->founded = placement->reconstruction = id;
  placement->placed = std::move(start.placed);
  placement->inlier_count = start.point_count;
  placement->detail = "founded with " + std::to_string(start.point_count) + " points";
  const std::vector<ImageId> near = placement->placed;
  VEDUTA_RETURN_IF_ERROR(MergeWhatItJoins(context, at_hand, near, placement));
  return placement->merges.empty()
             ? Status::Ok()
             : AdjustAround(context, at_hand.photo.id, context.options.local_images_max);
}

// Whether the submap of the image, or else its reconstruction, was judged only a few images ago, so
// that another judgment can wait; `unwritten` of the images since then are not stored yet.
Result<bool> IsFreshlyJudged(const MappingContext& context, ImageId image,
                             std::span<const ImageId> near, uint32_t unwritten) {
  const uint32_t between_min = context.options.doubt.images_between_min;
  VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(context.loader->snapshot()));
  for (const ImageId id : near) {
    if (const SubmapRecord* const submap = submaps.FindOf(id))
      return submap->images.size() + unwritten < submap->images_at_adjustment + between_min;
  }
  VEDUTA_ASSIGN_OR_RETURN(
      const ReconstructionRecord record,
      context.loader->GetReconstruction(context.map->image(image).reconstruction));
  const uint32_t between = std::max(between_min, record.image_count / 100);
  return record.image_count + unwritten < record.images_at_adjustment + between;
}

// Loads the structure of what the images have verified pairs with: where these lie apart they need
// not share a point.
Status LoadPaired(const MappingContext& context, std::span<const ImageId> images) {
  std::set<ImageId> paired;
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                            context.loader->snapshot().ListNeighbors(id));
    for (const PairNeighbor& neighbor : neighbors) paired.insert(neighbor.image);
  }
  return context.loader->LoadStructure(std::vector(paired.begin(), paired.end()));
}

// Whether the image's verified pairs draw it elsewhere. What they are with must be loaded.
Result<bool> IsDrawn(const MappingContext& context, ImageId id) {
  const CityMap& map = *context.map;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          context.loader->snapshot().ListNeighbors(id));
  std::vector<PairMatches> pairs;
  for (const PairNeighbor& neighbor : neighbors) {
    if (!map.HasImage(neighbor.image)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, context.loader->GetPair(id, neighbor.image));
    pairs.push_back(MatchesFrom(stored, id));
  }
  return IsDrawnElsewhere(map, id, pairs);
}

// Whether the submap or reconstruction of a photo that has just been placed must be judged again:
// many of the photo's verified matches contradict its pose, or the picture of an image around it
// lacks what others see there, or verified pairs draw such an image elsewhere.
Result<bool> RaisesDoubt(const MappingContext& context, ImageId photo,
                         const NeighborAgreement& agreement) {
  const DoubtOptions& options = context.options.doubt;
  const CityMap& map = *context.map;
  const std::vector<ImageId> near = CovisibleImages(map, photo, options.images_max);
  VEDUTA_ASSIGN_OR_RETURN(const bool is_fresh, IsFreshlyJudged(context, photo, near, 1));
  if (is_fresh) return false;
  if (static_cast<double>(agreement.contradicting_matches) >
      options.raising_contradiction_share_min * static_cast<double>(agreement.agreeing_matches))
    return true;
  // Which images share points with another is only known where its points are loaded.
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(near));
  for (const ImageId id : near)
    VEDUTA_RETURN_IF_ERROR(
        context.loader->LoadNeighborhood(CovisibleImages(map, id, options.images_max)));
  VEDUTA_RETURN_IF_ERROR(LoadPaired(context, near));
  std::vector<Result<bool>> is_doubtful(near.size(), false);
  context.pool->ParallelFor(near.size(), [&](size_t i) {
    const std::vector<ImageId> around = CovisibleImages(map, near[i], options.images_max);
    is_doubtful[i] = IsContradicted(JudgeAround(map, map.image(near[i]), around, options), options)
                         ? Result<bool>(true)
                         : IsDrawn(context, near[i]);
  });
  for (const Result<bool>& found : is_doubtful) VEDUTA_RETURN_IF_ERROR(found.status());
  return std::ranges::any_of(is_doubtful, [](const Result<bool>& found) { return *found; });
}

// The image of the reconstruction that shares most matches with the photo; not valid() where none
// does.
ImageId StrongestNeighbor(const CityMap& map, std::span<const PairMatches> pairs,
                          ReconstructionId reconstruction) {
  const PairMatches* strongest = nullptr;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction != reconstruction)
      continue;
    if (strongest == nullptr || pair.matches.size() > strongest->matches.size()) strongest = &pair;
  }
  return strongest == nullptr ? ImageId() : strongest->other;
}

// By which image `reconstruction` is to be judged again, where a pose in it was found for the photo
// and refused (PoseSearch::doubtful): perhaps two places were taken for one there. Not valid()
// where the judgment can wait.
Result<ImageId> FindDoubtful(const MappingContext& context, std::span<const PairMatches> pairs,
                             ReconstructionId reconstruction) {
  const ImageId near = StrongestNeighbor(*context.map, pairs, reconstruction);
  if (!near.valid()) return ImageId();
  VEDUTA_ASSIGN_OR_RETURN(const bool is_fresh, IsFreshlyJudged(context, near, {&near, 1}, 0));
  return is_fresh ? ImageId() : near;
}

// What is to be said against the side on which the photo stands, and those with which it has
// verified pairs, on either side of a seam: what it sees is new to them, too.
Result<SideDoubts> WeighAround(const MappingContext& context, const PhotoAtHand& at_hand,
                               ReconstructionId own, ReconstructionId other) {
  SideDoubts doubts;
  VEDUTA_RETURN_IF_ERROR(WeighSide(context, at_hand.photo.id, at_hand.pairs, other, &doubts));
  std::vector<ImageId> paired;
  for (const PairMatches& pair : at_hand.pairs) paired.push_back(pair.other);
  VEDUTA_ASSIGN_OR_RETURN(SideDoubts here, WeighSides(context, paired, own, other));
  VEDUTA_ASSIGN_OR_RETURN(SideDoubts there, WeighSides(context, paired, other, own));
  for (SideDoubts* const found : {&here, &there}) {
    std::ranges::move(found->misplaced, std::back_inserter(doubts.misplaced));
    std::ranges::move(found->unsure, std::back_inserter(doubts.unsure));
  }
  return doubts;
}

// Those of either kind, ascending.
std::vector<ImageId> NotSure(const SideDoubts& doubts) {
  std::set<ImageId> images(doubts.unsure.begin(), doubts.unsure.end());
  for (const DoubtedImage& image : doubts.misplaced) images.insert(image.image);
  return {images.begin(), images.end()};
}

// Notes who is not sure of their side, at each seam of two places that look alike to which the
// photo has led. Who stands on the wrong one is found again when the seam is judged.
Status WeighAtSeams(const MappingContext& context, const PhotoAtHand& at_hand,
                    Placement* placement) {
  const ReconstructionId own = placement->reconstruction;
  for (HypothesisRecord& refused : placement->refused) {
    if (!TellsPlacesApart(refused.reason)) continue;
    const ReconstructionId other = refused.a == own ? refused.b : refused.a;
    VEDUTA_ASSIGN_OR_RETURN(const SideDoubts doubts, WeighAround(context, at_hand, own, other));
    std::ranges::set_intersection(NotSure(doubts), refused.images,
                                  std::back_inserter(refused.unsure));
  }
  for (KnownSeam& known : placement->known) {
    if (!TellsPlacesApart(known.reason)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const SideDoubts doubts,
                            WeighAround(context, at_hand, own, known.other));
    known.unsure = NotSure(doubts);
  }
  return Status::Ok();
}

// The first case, and the second where it joins reconstructions. Returns the photo postponed where
// its pose is not believed.
Result<std::optional<Placement>> PlaceAt(const MappingContext& context, const PhotoAtHand& at_hand,
                                         const PoseCandidate& pose, Stopwatch* watch,
                                         Placement* placement) {
  const MapperOptions& options = context.options;
  const ImageId id = at_hand.photo.id;
  VEDUTA_ASSIGN_OR_RETURN(std::optional<Placement> postponed,
                          EnterPose(context, at_hand.photo, pose, at_hand.putative));
  if (postponed) return postponed;
  *placement = PlacedAt(at_hand.photo, pose);
  placement->strongest = StrongestNeighbor(*context.map, at_hand.pairs, placement->reconstruction);
  const std::vector<ImageId> near = CovisibleImages(*context.map, id, options.local_images_max);
  VEDUTA_RETURN_IF_ERROR(MergeWhatItJoins(context, at_hand, near, placement));
  if (!placement->merges.empty())
    GrowFromAgreeing(context.map, id, at_hand.putative, options.growth);
  placement->map_ms = watch->LapMs();
  // A pose leads to further matches only once the verified ones have settled it: on repeated
  // texture a pose that is a little wrong finds many matches that agree with it.
  VEDUTA_RETURN_IF_ERROR(AdjustAround(context, id, options.settled_images_max));
  placement->adjust_ms = watch->LapMs();
  VEDUTA_RETURN_IF_ERROR(GrowAround(context, id));
  placement->map_ms += watch->LapMs();
  VEDUTA_RETURN_IF_ERROR(AdjustAround(context, id, options.local_images_max));
  placement->adjust_ms += watch->LapMs();
  VEDUTA_ASSIGN_OR_RETURN(postponed, AskWhatIsMissing(context, id));
  if (postponed) return postponed;
  if (placement->merges.empty()) {
    VEDUTA_RETURN_IF_ERROR(WeighAtSeams(context, at_hand, placement));
    VEDUTA_ASSIGN_OR_RETURN(const bool raises_doubt, RaisesDoubt(context, id, pose.agreement));
    if (raises_doubt) placement->doubtful = id;
  }
  return std::optional<Placement>();
}

Result<Placement> PlaceByPairs(const MappingContext& context, const ImageFeatures& photo,
                               std::span<const PairMatches> pairs,
                               ReconstructionId new_reconstruction, uint64_t seed) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(const SoughtPoses sought, SeekPoses(context, photo, pairs, seed));
  const PhotoAtHand at_hand{photo, pairs, sought.putative, seed};
  Placement placement = Postponed(sought.search.reason, sought.search.detail);
  if (!sought.has_sure_pose() && new_reconstruction.valid())
    VEDUTA_RETURN_IF_ERROR(TryToFound(context, at_hand, new_reconstruction, &placement));
  VEDUTA_ASSIGN_OR_RETURN(const PoseCandidate* const pose,
                          ChoosePose(context, photo, sought.search.found));
  if (pose == nullptr || placement.verdict != Verdict::kPostponed) {
    if (placement.verdict == Verdict::kPostponed) {
      VEDUTA_ASSIGN_OR_RETURN(placement.doubtful,
                              FindDoubtful(context, pairs, sought.search.doubtful));
    }
    placement.map_ms = watch.LapMs();
    return placement;
  }
  VEDUTA_ASSIGN_OR_RETURN(std::optional<Placement> postponed,
                          PlaceAt(context, at_hand, *pose, &watch, &placement));
  if (postponed) {
    context.map->Clear();
    // Other photos may wait for the same reason, and may found a reconstruction together with this
    // one.
    if (sought.has_sure_pose() && new_reconstruction.valid()) {
      VEDUTA_RETURN_IF_ERROR(LoadNeighbors(context, pairs));
      VEDUTA_RETURN_IF_ERROR(TryToFound(context, at_hand, new_reconstruction, &*postponed));
    }
    return std::move(*postponed);
  }
  if (std::optional<Placement> too_little = AskHowMuchItSees(context, photo.id)) {
    context.map->Clear();
    return std::move(*too_little);
  }
  return placement;
}

}  // namespace

Result<Placement> PlacePhoto(const MappingContext& context, const ImageFeatures& photo,
                             std::span<const PairMatches> pairs,
                             ReconstructionId new_reconstruction, uint64_t seed) {
  const Snapshot& snapshot = context.loader->snapshot();
  VEDUTA_ASSIGN_OR_RETURN(const bool is_forbidden, IsPoseForbidden(snapshot, photo.id));
  if (is_forbidden) return Postponed(Reason::kForbidden, kPoseForbiddenDetail);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> allowed,
                          WithoutForbidden(snapshot, pairs));
  return PlaceByPairs(context, photo, allowed, new_reconstruction, seed);
}

}  // namespace veduta
