// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/reconstruction_adjustment.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "engine/ingest/local_unplacing.h"
#include "engine/ingest/surroundings.h"
#include "engine/mapping/agreeing_growth.h"
#include "engine/mapping/better_pose.h"
#include "engine/mapping/projection_growth.h"
#include "engine/matching/mutual_matcher.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Images whose pairs are read side by side, and held in memory. Chosen by hand; not measured.
constexpr size_t kImagesReadAtOnce = 64;

bool Holds(std::span<const ImageId> ascending, ImageId id) {
  return std::ranges::binary_search(ascending, id);
}

// A placed image's neighbours in the region, those with most verified matches first. Their matches
// are still to be found.
Result<std::vector<PairMatches>> ListPlacedNeighbors(const MappingContext& context,
                                                     const Region& region, ImageId id) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<PairNeighbor> neighbors,
                          context.loader->snapshot().ListNeighbors(id));
  std::erase_if(neighbors, [&](const PairNeighbor& n) { return !Holds(region.known, n.image); });
  std::stable_sort(
      neighbors.begin(), neighbors.end(),
      [](const PairNeighbor& a, const PairNeighbor& b) { return a.match_count > b.match_count; });
  const uint32_t count_max = context.options.local_images_max;
  if (neighbors.size() > count_max) neighbors.resize(count_max);
  std::vector<PairMatches> pairs;
  for (const PairNeighbor& neighbor : neighbors) pairs.push_back({neighbor.image, {}, {}, {}});
  return pairs;
}

std::vector<FeatureMatch> FeaturesOf(std::span<const DescriptorMatch> found) {
  std::vector<FeatureMatch> matches;
  matches.reserve(found.size());
  for (const DescriptorMatch& match : found) matches.push_back({match.a, match.b});
  return matches;
}

// Two images whose matches are wanted: those of the first with the second, and the other way round.
// Null where that way is not wanted.
struct WantedMatches {
  ImageId first, second;
  PairMatches *from_first = nullptr, *from_second = nullptr;
};

// Each two images once, in ascending ids, whichever of them is a neighbour of the other.
std::vector<WantedMatches> ListWanted(std::span<const ImageId> images,
                                      std::span<std::vector<PairMatches>> neighbors) {
  std::map<std::pair<ImageId, ImageId>, WantedMatches> wanted;
  for (size_t i = 0; i < images.size(); ++i) {
    for (PairMatches& pair : neighbors[i]) {
      const auto [first, second] = std::minmax(images[i], pair.other);
      WantedMatches& both = wanted[{first, second}];
      both.first = first, both.second = second;
      (images[i] == first ? both.from_first : both.from_second) = &pair;
    }
  }
  std::vector<WantedMatches> list;
  for (const auto& [ids, both] : wanted) list.push_back(both);
  return list;
}

Status FindMatches(const MappingContext& context, const WantedMatches& wanted) {
  const auto features = [&](ImageId id) {
    return context.loader->features()->Get(context.loader->snapshot(), id);
  };
  VEDUTA_ASSIGN_OR_RETURN(const auto first, features(wanted.first));
  VEDUTA_ASSIGN_OR_RETURN(const auto second, features(wanted.second));
  MatchOptions options;
  options.ratio_max = context.options.putative_ratio_max;
  const MatchesBothWays found = MatchBothWays(first->packed, second->packed, options);
  if (wanted.from_first != nullptr) wanted.from_first->matches = FeaturesOf(found.from_a);
  if (wanted.from_second != nullptr) wanted.from_second->matches = FeaturesOf(found.from_b);
  return Status::Ok();
}

// Matches of each of the region's images with its neighbours there, those with most verified
// matches first.
Result<std::vector<std::vector<PairMatches>>> MatchNeighbors(const MappingContext& context,
                                                             const Region& region) {
  const std::vector<ImageId>& images = region.images;
  std::vector<std::vector<PairMatches>> matches(images.size());
  std::vector<Status> listed(images.size());
  context.pool->ParallelFor(images.size(), [&](size_t i) {
    Result<std::vector<PairMatches>> neighbors = ListPlacedNeighbors(context, region, images[i]);
    listed[i] = neighbors.status();
    if (neighbors.ok()) matches[i] = *std::move(neighbors);
  });
  for (const Status& status : listed) VEDUTA_RETURN_IF_ERROR(status);
  const std::vector<WantedMatches> wanted = ListWanted(images, matches);
  std::vector<Status> found(wanted.size());
  context.pool->ParallelFor(wanted.size(),
                            [&](size_t i) { found[i] = FindMatches(context, wanted[i]); });
  for (const Status& status : found) VEDUTA_RETURN_IF_ERROR(status);
  return matches;
}

// The image's verified pairs in the region, those that an image of a lower id does not have.
Result<std::vector<PairMatches>> ReadPairs(const MappingContext& context, const Region& region,
                                           ImageId id) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          context.loader->snapshot().ListNeighbors(id));
  std::vector<PairMatches> pairs;
  for (const PairNeighbor& neighbor : neighbors) {
    const bool is_read_there = neighbor.image > id && Holds(region.images, neighbor.image);
    if (is_read_there || !Holds(region.known, neighbor.image)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, context.loader->GetPair(id, neighbor.image));
    pairs.push_back(MatchesFrom(stored, id));
  }
  return pairs;
}

// Joins tracks by all verified pairs of the region. What two parts saw before they were merged
// stands in the map twice, and only what is one holds a seam together.
Status GrowFromPairs(const MappingContext& context, const Region& region) {
  const std::span<const ImageId> images = region.images;
  for (size_t begin = 0; begin < images.size(); begin += kImagesReadAtOnce) {
    const auto some = images.subspan(begin, std::min(kImagesReadAtOnce, images.size() - begin));
    std::vector<Result<std::vector<PairMatches>>> pairs(some.size(), std::vector<PairMatches>());
    context.pool->ParallelFor(some.size(),
                              [&](size_t i) { pairs[i] = ReadPairs(context, region, some[i]); });
    for (size_t i = 0; i < some.size(); ++i) {
      VEDUTA_RETURN_IF_ERROR(pairs[i].status());
      GrowFromMatches(context.map, some[i], *pairs[i], context.options.growth);
    }
  }
  return Status::Ok();
}

// Completes the tracks of the images by what is seen in `known`, adjusts them and their points, and
// filters.
Status GrowAndAdjust(const MappingContext& context, std::span<const ImageId> images,
                     std::span<const ImageId> known) {
  CityMap* const map = context.map;
  const MapperOptions& options = context.options;
  GrowAllByProjection(map, images, known, options.local_images_max, options.growth, context.pool);
  const std::vector<PointId> points = map->PointsSeenBy(images);
  VEDUTA_RETURN_IF_ERROR(
      AdjustBundle(map, images, points, options.global_bundle, context.pool).status());
  FilterPoints(map, points, options.filter);
  return Status::Ok();
}

// A reconstruction is of three images at least.
constexpr size_t kImagesMin = 3;

// Takes the poses of images of the group that see fewer points than a pose needs, and of all of it
// where fewer than `left_min` images would be left. Whether there were any.
bool UnplaceUnsupported(const MappingContext& context, size_t left_min, std::vector<ImageId>* group,
                        Healing* healing) {
  CityMap* const map = context.map;
  const auto unplace = [&](ImageId id, const std::string& why) {
    map->UnplaceImage(id);
    healing->unplaced.push_back({id, why});
  };
  const size_t unplaced = std::erase_if(*group, [&](ImageId id) {
    const uint32_t seen = CountObservations(map->image(id));
    if (seen >= context.options.observations_min) return false;
    unplace(id, "only " + std::to_string(seen) + " points hold it; " +
                    std::to_string(context.options.observations_min) + " are needed");
    return true;
  });
  if (unplaced == 0 || group->size() >= left_min) return unplaced > 0;
  for (const ImageId id : *group) unplace(id, "less than three images are left there");
  group->clear();
  return true;
}

// Cuts, filters and lost poses take points from images that keep theirs, and growing does not
// always give them others. `staying` are the images of the region that are in no part.
void HealUnsupported(const MappingContext& context, bool is_whole, std::vector<ImageId>* staying,
                     Healing* healing) {
  for (bool changes = true; changes;) {
    changes = UnplaceUnsupported(context, is_whole ? kImagesMin : 0, staying, healing);
    for (std::vector<ImageId>& part : healing->parts)
      changes = UnplaceUnsupported(context, kImagesMin, &part, healing) || changes;
  }
  std::erase_if(healing->parts, [](const std::vector<ImageId>& part) { return part.empty(); });
}

// Adds images of the same reconstruction that the images have verified pairs with: where a loop
// meets, they need not share a point yet.
Status AddNeighbors(const MappingContext& context, std::span<const ImageId> images,
                    std::set<ImageId>* known) {
  std::set<ImageId> neighbors;
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> pairs,
                            context.loader->snapshot().ListNeighbors(id));
    for (const PairNeighbor& pair : pairs) neighbors.insert(pair.image);
  }
  VEDUTA_RETURN_IF_ERROR(
      context.loader->LoadImages(std::vector(neighbors.begin(), neighbors.end())));
  const CityMap& map = *context.map;
  const ReconstructionId own = map.image(images.front()).reconstruction;
  for (const ImageId id : neighbors) {
    if (map.HasImage(id) && map.image(id).reconstruction == own) known->insert(id);
  }
  return Status::Ok();
}

}  // namespace

Result<Region> LoadRegion(const MappingContext& context, std::span<const ImageId> images,
                          bool with_neighbors) {
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(images));
  const CityMap& map = *context.map;
  std::set<ImageId> known(images.begin(), images.end());
  for (const PointId point : map.PointsSeenBy(images)) {
    for (const TrackElement& element : map.point(point).track) known.insert(element.image);
  }
  // An image need not see all points that it is home to; they get another home where it loses its
  // pose.
  for (const ImageId id : images) {
    for (const PointRecord& point : map.StoredBlock(id).points) {
      for (const TrackElement& element : point.track) known.insert(element.image);
    }
  }
  if (with_neighbors) VEDUTA_RETURN_IF_ERROR(AddNeighbors(context, images, &known));
  Region region{{images.begin(), images.end()}, {known.begin(), known.end()}};
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(region.known));
  return region;
}

Status ReconsiderPoses(const MappingContext& context, const Region& region) {
  CityMap* const map = context.map;
  const std::vector<ImageId>& images = region.images;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::vector<PairMatches>> putative,
                          MatchNeighbors(context, region));
  std::vector<std::optional<Resection>> better(images.size());
  context.pool->ParallelFor(images.size(), [&](size_t i) {
    better[i] = FindBetterPose(*map, images[i], putative[i], MixSeed(images[i].value, 2),
                               context.options.resection);
  });
  for (size_t i = 0; i < images.size(); ++i) {
    if (!better[i]) continue;
    const ImageId self[] = {images[i]};
    for (const PointId point : map->PointsSeenBy(self)) map->RemoveObservation(point, images[i]);
    map->SetPose(images[i], better[i]->cam_from_world);
    GrowAndRefine(map, images[i], putative[i], context.options.growth);
  }
  return Status::Ok();
}

Result<Healing> AdjustRegion(const MappingContext& context, const Region& region) {
  std::vector<ImageId> images = region.images;
  VEDUTA_RETURN_IF_ERROR(ReconsiderPoses(context, region));
  // Twice, for what the first adjustment has corrected lets tracks grow and filters judge anew.
  // That two rounds are enough was chosen by hand and not measured.
  VEDUTA_RETURN_IF_ERROR(GrowAndAdjust(context, images, region.known));
  VEDUTA_RETURN_IF_ERROR(GrowFromPairs(context, region));
  VEDUTA_RETURN_IF_ERROR(GrowAndAdjust(context, images, region.known));
  VEDUTA_ASSIGN_OR_RETURN(Healing healing, HealRegion(context, images, region.known));
  for (const DoubtedImage& unplaced : healing.unplaced) std::erase(images, unplaced.image);
  for (const std::vector<ImageId>& part : healing.parts) {
    VEDUTA_RETURN_IF_ERROR(GrowAndAdjust(context, part, region.known));
    for (const ImageId image : part) std::erase(images, image);
  }
  if (!healing.empty() && !images.empty())
    VEDUTA_RETURN_IF_ERROR(GrowAndAdjust(context, images, region.known));
  HealUnsupported(context, region.images.size() == region.known.size(), &images, &healing);
  return healing;
}

Healing CutOffPart(const MappingContext& context, const Region& region) {
  Healing healing;
  context.map->CutOff({region.images.begin(), region.images.end()});
  healing.parts.push_back(region.images);
  std::vector<ImageId> nothing_else;
  HealUnsupported(context, false, &nothing_else, &healing);
  return healing;
}

Result<Healing> AdjustReconstruction(const MappingContext& context, ReconstructionId id) {
  Region whole;
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadReconstruction(id, &whole.images, context.pool));
  whole.known = whole.images;
  return AdjustRegion(context, whole);
}

}  // namespace veduta
