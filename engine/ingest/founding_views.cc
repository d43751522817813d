// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/founding_views.h"

#include <algorithm>
#include <set>

namespace veduta {
namespace {

// Neighbours without a pose, most matches first.
std::vector<const PairMatches*> UnplacedNeighbors(const CityMap& map,
                                                  std::span<const PairMatches> pairs,
                                                  size_t count_max) {
  std::vector<const PairMatches*> unplaced;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other)) unplaced.push_back(&pair);
  }
  std::stable_sort(unplaced.begin(), unplaced.end(),
                   [](const PairMatches* a, const PairMatches* b) {
                     return a->matches.size() > b->matches.size();
                   });
  if (unplaced.size() > count_max) unplaced.resize(count_max);
  return unplaced;
}

// The stored pairs between `id` and members of greater ids, without the photo's.
Status AppendStoredPairs(const MapLoader& loader, ImageId id, ImageId photo,
                         const std::set<ImageId>& members, FoundingViews* views) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          loader.snapshot().ListNeighbors(id));
  for (const PairNeighbor& neighbor : neighbors) {
    if (neighbor.image <= id || neighbor.image == photo || !members.contains(neighbor.image))
      continue;
    VEDUTA_ASSIGN_OR_RETURN(PairRecord stored, loader.GetPair(id, neighbor.image));
    views->pairs.push_back(std::move(stored));
  }
  return Status::Ok();
}

}  // namespace

Result<FoundingViews> GatherFoundingViews(MapLoader* loader, const CityMap& map,
                                          const ImageFeatures& photo,
                                          std::span<const PairMatches> pairs, uint32_t count_max) {
  const Snapshot& snapshot = loader->snapshot();
  FoundingViews views;
  std::set<ImageId> members = {photo.id};
  views.images.push_back(UnplacedImage(photo));
  for (const PairMatches* pair : UnplacedNeighbors(map, pairs, count_max - 1)) {
    VEDUTA_ASSIGN_OR_RETURN(const auto features, loader->features()->Get(snapshot, pair->other));
    views.images.push_back(UnplacedImage(*features));
    members.insert(pair->other);
    views.pairs.push_back(RecordOf(*pair, photo.id));
  }
  std::sort(views.images.begin(), views.images.end(),
            [](const MapImage& a, const MapImage& b) { return a.id < b.id; });
  for (const ImageId id : members) {
    if (id == photo.id) continue;
    VEDUTA_RETURN_IF_ERROR(AppendStoredPairs(*loader, id, photo.id, members, &views));
  }
  return views;
}

}  // namespace veduta
