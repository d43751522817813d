// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/photo_locator.h"

#include <algorithm>

#include "engine/ingest/photo_placement.h"
#include "storage/base/content_hash.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

std::string NoNeighborDetail(const NeighborSearch& search) {
  if (search.tried_count == 0) return "the database holds no photo to compare with yet";
  std::string text =
      "none of " + std::to_string(search.tried_count) + " candidates passed the geometric check";
  if (search.best_inlier_count > 0) {
    text += "; the best, image " + std::to_string(search.best_failed.value) + ", has " +
            std::to_string(search.best_inlier_count) + " consistent matches";
  }
  return text;
}

// One photo's search, in one or two rounds.
class Locator {
 public:
  Locator(const MappingContext& context, const IngestOptions& options, const PoseGiver& give_pose,
          uint64_t seed)
      : context_(context), options_(options), give_pose_(give_pose), seed_(seed) {}

  // Joins the neighbours among `candidates` to those that are known already.
  Status Search(const ImageFeatures& photo, std::span<const RankedImage> candidates,
                const NeighborOptions& options, uint64_t seed) {
    Stopwatch watch;
    VEDUTA_ASSIGN_OR_RETURN(NeighborSearch found,
                            FindNeighbors(photo, candidates, seed, context_.loader, *context_.map,
                                          context_.pool, options));
    // The pairs went side by side: the wall time is shared out as their time of one core.
    const double search_ms = watch.LapMs(),
                 pair_ms = std::max(found.match_ms + found.verify_ms, 1e-9);
    located_.times.match_ms += search_ms * found.match_ms / pair_ms;
    located_.times.verify_ms += search_ms * found.verify_ms / pair_ms;
    JoinSearches(photo.id, std::move(found), &located_.search);
    return Status::Ok();
  }

  // Searches the most promising candidates once more. `wide` holds more of the photo's features.
  Status SearchThoroughly(const ImageFeatures& wide) {
    NeighborOptions options = options_.neighbors;
    options.extended_count_max = 0;
    const std::vector<RankedImage> promising = std::move(located_.search.promising);
    const size_t count = std::min<size_t>(promising.size(), options_.thorough_pairs_max);
    return Search(wide, {promising.data(), count}, options, MixSeed(seed_, 3));
  }

  Status Place(const ImageFeatures& photo) {
    const NeighborSearch& search = located_.search;
    if (search.pairs.empty()) {
      located_.placement = Placement();
      located_.placement.reason =
          search.tried_count == 0 ? Reason::kNoCandidates : Reason::kNoVerifiedNeighbor;
      located_.placement.detail = NoNeighborDetail(search);
      located_.placement.inlier_count = search.best_inlier_count;
      return Status::Ok();
    }
    std::vector<PairMatches> pairs;
    for (const PairRecord& pair : search.pairs) pairs.push_back(MatchesFrom(pair, photo.id));
    VEDUTA_ASSIGN_OR_RETURN(located_.placement, give_pose_(photo, pairs));
    located_.times.map_ms += located_.placement.map_ms;
    located_.times.adjust_ms += located_.placement.adjust_ms;
    return Status::Ok();
  }

  // A neighbour shares so much with the photo that more features need not be asked.
  bool HasAmpleNeighbor() const {
    const std::vector<PairRecord>& pairs = located_.search.pairs;
    return std::any_of(pairs.begin(), pairs.end(), [&](const PairRecord& pair) {
      return pair.matches.size() >= options_.ample_match_count;
    });
  }
  bool IsPlaced() const { return located_.placement.verdict != Verdict::kPostponed; }
  LocatedPhoto Take() { return std::move(located_); }

 private:
  const MappingContext& context_;
  const IngestOptions& options_;
  const PoseGiver& give_pose_;
  const uint64_t seed_;
  LocatedPhoto located_;
};

}  // namespace

Result<LocatedPhoto> LocatePhoto(const MappingContext& context, const IngestOptions& options,
                                 const ImageFeatures& photo, const CameraModel& camera,
                                 std::span<const RankedImage> candidates,
                                 const PoseGiver& give_pose, uint64_t seed) {
  Locator locator(context, options, give_pose, seed);
  VEDUTA_RETURN_IF_ERROR(locator.Search(photo, candidates, options.neighbors, seed));
  if (locator.HasAmpleNeighbor() || candidates.empty()) {
    VEDUTA_RETURN_IF_ERROR(locator.Place(photo));
    if (locator.IsPlaced() || candidates.empty()) return locator.Take();
  }
  VEDUTA_ASSIGN_OR_RETURN(const auto wide, ImageFeatures::Make(photo.id, camera, photo.features,
                                                               options.thorough_count_max,
                                                               ImageFeatures::Packing::kKept));
  VEDUTA_RETURN_IF_ERROR(locator.SearchThoroughly(*wide));
  VEDUTA_RETURN_IF_ERROR(locator.Place(*wide));
  return locator.Take();
}

Result<LocatedPhoto> LocatePhoto(const MappingContext& context, const IngestOptions& options,
                                 const ImageFeatures& photo, const CameraModel& camera,
                                 std::span<const RankedImage> candidates,
                                 ReconstructionId new_reconstruction, uint64_t seed) {
  const PoseGiver place = [&](const ImageFeatures& features, std::span<const PairMatches> pairs) {
    return PlacePhoto(context, features, pairs, new_reconstruction, seed);
  };
  return LocatePhoto(context, options, photo, camera, candidates, place, seed);
}

}  // namespace veduta
