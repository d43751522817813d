// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/reconstruction_adjustment.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "engine/ingest/lens_refinement.h"
#include "engine/ingest/local_unplacing.h"
#include "engine/ingest/surroundings.h"
#include "engine/mapping/agreeing_growth.h"
#include "engine/mapping/projection_growth.h"

namespace veduta {
namespace {

// Images whose pairs are read side by side, and held in memory. Chosen by hand; not measured.
constexpr size_t kImagesReadAtOnce = 64;

bool Holds(std::span<const ImageId> ascending, ImageId id) {
  return std::ranges::binary_search(ascending, id);
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

// Adjusts the images and their points, and filters.
Status Adjust(const MappingContext& context, std::span<const ImageId> images) {
  const std::vector<PointId> points = context.map->PointsSeenBy(images);
  VEDUTA_RETURN_IF_ERROR(
      AdjustBundle(context.map, images, points, context.options.global_bundle, context.pool)
          .status());
  FilterPoints(context.map, points, context.options.filter);
  return Status::Ok();
}

// Completes the tracks of the images by what is seen in `known`, and adjusts.
Status GrowAndAdjust(const MappingContext& context, std::span<const ImageId> images,
                     std::span<const ImageId> known) {
  GrowAllByProjection(context.map, images, known, context.options.local_images_max,
                      context.options.growth, context.pool);
  return Adjust(context, images);
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

Result<Healing> AdjustRegion(const MappingContext& context, const Region& region) {
  std::vector<ImageId> images = region.images;
  VEDUTA_RETURN_IF_ERROR(ReconsiderBodies(context, region));
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
  // Only what stays together: where two places were taken for one, points of two views are what
  // speaks against it.
  if (healing.empty() &&
      RemoveStrayPoints(context.map, images, context.options.strays, context.pool) > 0)
    VEDUTA_RETURN_IF_ERROR(Adjust(context, images));
  HealUnsupported(context, region.images.size() == region.known.size(), &images, &healing);
  return healing;
}

Healing TakeOut(const MappingContext& context, Healing found) {
  for (const DoubtedImage& doubted : found.unplaced) context.map->UnplaceImage(doubted.image);
  for (const std::vector<ImageId>& part : found.parts)
    context.map->CutOff({part.begin(), part.end()});
  std::vector<ImageId> nothing_else;
  HealUnsupported(context, false, &nothing_else, &found);
  return found;
}

Result<Healing> AdjustReconstruction(const MappingContext& context, ReconstructionId id,
                                     Lenses lenses) {
  Region whole;
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadReconstruction(id, &whole.images));
  whole.known = whole.images;
  std::vector<RefinedLens> refined;
  if (lenses == Lenses::kRefined) {
    VEDUTA_ASSIGN_OR_RETURN(refined, RefineLenses(context, id, whole.images));
  }
  VEDUTA_ASSIGN_OR_RETURN(Healing healing, AdjustRegion(context, whole));
  healing.lenses = std::move(refined);
  return healing;
}

}  // namespace veduta
