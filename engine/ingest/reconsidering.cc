// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/reconsidering.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "engine/ingest/seam.h"
#include "engine/mapping/agreeing_growth.h"
#include "engine/mapping/better_body.h"
#include "engine/mapping/better_pose.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Images of a body, at most: half of a reconstruction that is adjusted as a whole. With 64 the rows
// of a street of 200, of some 100 images each, stayed at an angle of 3 degrees.
constexpr size_t kBodyImagesMax = 100;

bool Holds(std::span<const ImageId> ascending, ImageId id) {
  return std::ranges::binary_search(ascending, id);
}

// Verified pairs of the body's images with images of the region that are not of the body.
Result<std::vector<BodyPair>> ReadPairsAcross(const MappingContext& context, const Region& region,
                                              std::span<const ImageId> body) {
  std::vector<BodyPair> pairs;
  for (const ImageId id : body) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                            context.loader->snapshot().ListNeighbors(id));
    for (const PairNeighbor& neighbor : neighbors) {
      if (neighbor.geometry == PairGeometry::kRotation || !Holds(region.known, neighbor.image) ||
          Holds(body, neighbor.image))
        continue;
      VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, context.loader->GetPair(id, neighbor.image));
      pairs.push_back({id, MatchesFrom(stored, id)});
    }
  }
  return pairs;
}

// Where the body would meet the rest: the pairs that want it there, and their images.
SeamArea FindSeamThere(const MappingContext& context, std::span<const BodyPair> pairs,
                       const Sim3& here_from_there) {
  SeamArea all;
  std::set<ImageId> body, rest;
  for (const BodyPair& pair : pairs) {
    all.pairs.push_back({pair.image, pair.matches});
    body.insert(pair.image);
    rest.insert(pair.matches.other);
  }
  all.into.assign(body.begin(), body.end());
  all.other.assign(rest.begin(), rest.end());
  SeamArea seam;
  seam.pairs = PairsFor(*context.map, all, here_from_there, context.options);
  for (const ImageId id : SeamImages(seam.pairs))
    (body.contains(id) ? seam.into : seam.other).push_back(id);
  return seam;
}

// Whether the body would take a facade for its twin: the pictures of the body lack there what the
// rest sees, or the other way round.
bool IsAtTwin(const MappingContext& context, std::span<const BodyPair> pairs,
              const Sim3& there_from_here) {
  const Sim3 here_from_there = there_from_here.Inverse();
  const SeamArea seam = FindSeamThere(context, pairs, here_from_there);
  const DoubtOptions& doubt = context.options.doubt;
  return AskPictures(*context.map, seam, here_from_there, context.options)
      .LacksStructure(doubt, doubt.body_mixed_share_max);
}

// A body's better place, if there is one that the pictures do not speak against.
Result<std::optional<Sim3>> FindPlace(const MappingContext& context, const Region& region,
                                      std::span<const ImageId> body) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BodyPair> pairs,
                          ReadPairsAcross(context, region, body));
  std::optional<Sim3> better = FindBetterPlace(*context.map, body, pairs);
  if (better && IsAtTwin(context, pairs, *better)) better.reset();
  return better;
}

// The body's images and points leave the points that the rest sees, too. Tracks grow across anew by
// the verified pairs, after an adjustment in which the body stands free.
void CarryBody(CityMap* map, std::span<const ImageId> body, const Sim3& there_from_here) {
  map->CutOff({body.begin(), body.end()});
  for (const ImageId id : body) {
    const ReconstructionId own = map->image(id).reconstruction;
    map->MoveImage(id, own, there_from_here);
    map->MoveBlock(id, own, there_from_here);
  }
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
  for (const PairNeighbor& neighbor : neighbors)
    pairs.push_back({neighbor.image, {}, {}, {}, {}, {}});
  return pairs;
}

// Two images whose matches are wanted: those of `first` with `second`, and those the other way
// round. A null pointer says that this way is not wanted.
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
  const auto held = [&](ImageId id) {  // the cache may not hold as many images as the map
    const bool is_held = context.map->HasImage(id);
    return MatchedImage{id, is_held ? context.map->image(id).features : nullptr};
  };
  VEDUTA_ASSIGN_OR_RETURN(
      const auto found,
      context.loader->features()->Match(context.loader->snapshot(), held(wanted.first),
                                        held(wanted.second), context.options.putative_ratio_max));
  if (wanted.from_first != nullptr) wanted.from_first->matches = found->from_first;
  if (wanted.from_second != nullptr) wanted.from_second->matches = found->from_second;
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

}  // namespace

Status ReconsiderBodies(const MappingContext& context, const Region& region) {
  CityMap* const map = context.map;
  const std::vector<std::vector<ImageId>> bodies = ListBodies(*map, region.images, kBodyImagesMax);
  std::vector<std::optional<Sim3>> better(bodies.size());
  std::vector<Status> read(bodies.size());
  context.pool->ParallelFor(bodies.size(), [&](size_t i) {
    const Result<std::optional<Sim3>> place = FindPlace(context, region, bodies[i]);
    read[i] = place.status();
    if (place.ok()) better[i] = *place;
  });
  for (const Status& status : read) VEDUTA_RETURN_IF_ERROR(status);
  std::set<ImageId> moved;
  for (size_t i = bodies.size(); i-- > 0;) {  // backwards: large bodies before their parts
    const std::vector<ImageId>& body = bodies[i];
    if (!better[i] || std::ranges::any_of(body, [&](ImageId id) { return moved.contains(id); }))
      continue;
    if (!moved.empty()) {  // its place was found before others moved: seek it again
      VEDUTA_ASSIGN_OR_RETURN(better[i], FindPlace(context, region, body));
      if (!better[i]) continue;
    }
    moved.insert(body.begin(), body.end());
    CarryBody(map, body, *better[i]);
  }
  return Status::Ok();
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

}  // namespace veduta
