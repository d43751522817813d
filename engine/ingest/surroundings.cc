// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/surroundings.h"

#include <algorithm>
#include <vector>

#include "engine/mapping/projection_growth.h"

namespace veduta {

Status GrowAround(const MappingContext& context, ImageId image) {
  CityMap* const map = context.map;
  const GrowthOptions& options = context.options.growth;
  const std::vector<ImageId> near = CovisibleImages(*map, image, context.options.local_images_max);
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(near));
  std::vector<PairMatches> guided(std::min<size_t>(near.size(), context.options.guided_images_max));
  context.pool->ParallelFor(
      guided.size(), [&](size_t i) { guided[i] = MatchPlaced(*map, image, near[i], options); });
  GrowthOptions growth = options;
  growth.views_min = options.guided_views_min;
  GrowFromMatches(map, image, guided, growth);
  GrowByProjection(map, image, map->PointsSeenBy(near), options);
  const ImageId self[] = {image};
  const std::vector<PointId> own = map->PointsSeenBy(self);
  for (const ImageId id : near) GrowByProjection(map, id, own, options);
  return Status::Ok();
}

Status AdjustAround(const MappingContext& context, ImageId image, size_t images_max) {
  CityMap* const map = context.map;
  std::vector<ImageId> free = CovisibleImages(*map, image, images_max - 1);
  free.push_back(image);
  std::sort(free.begin(), free.end());
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(free));
  const std::vector<PointId> points = map->PointsSeenBy(free);
  VEDUTA_ASSIGN_OR_RETURN(
      const BundleSummary summary,
      AdjustBundle(map, free, points, context.options.local_bundle, context.pool));
  FilterPoints(map, points, context.options.filter);
  return summary.observations > 0 ? Status::Ok() : Status::InvalidArgument("nothing to adjust");
}

}  // namespace veduta
