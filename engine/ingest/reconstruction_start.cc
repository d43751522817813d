// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/reconstruction_start.h"

#include <algorithm>

#include "engine/ingest/founding_views.h"
#include "engine/ingest/surroundings.h"

namespace veduta {
namespace {

// Copies the triple's images and points into the map. Images that it places, ascending.
std::vector<ImageId> PlaceTriple(const CityMap& triple, ImageId home, uint32_t* point_count,
                                 CityMap* map) {
  std::vector<ImageId> placed;
  for (const auto& [id, image] : triple.images()) {
    MapImage copy = image;
    copy.points.assign(copy.features->size(), PointId{});
    map->PlaceImage(std::move(copy));
    placed.push_back(id);
  }
  const std::vector<PointId> points = triple.PointsSeenBy(placed);
  for (const PointId point : points)
    map->AddPoint(home, triple.point(point).position, triple.point(point).track);
  *point_count = static_cast<uint32_t>(points.size());
  return placed;
}

}  // namespace

Result<ReconstructionStart> StartReconstruction(const MappingContext& context,
                                                const ImageFeatures& photo,
                                                std::span<const PairMatches> pairs,
                                                ReconstructionId id, uint64_t seed) {
  VEDUTA_ASSIGN_OR_RETURN(const FoundingViews views,
                          GatherFoundingViews(context.loader, *context.map, photo, pairs,
                                              context.options.founding_views_max));
  ReconstructionStart start;
  start.view_count = static_cast<uint32_t>(views.images.size());
  CityMap triple;
  if (start.view_count >= 3)
    start.outcome = TryFounding(views, photo.id, id, seed, context.options.founding, &triple,
                                context.repetitions);
  if (start.outcome != FoundingOutcome::kFounded) return start;
  start.placed = PlaceTriple(triple, photo.id, &start.point_count, context.map);
  for (const ImageId image : start.placed) VEDUTA_RETURN_IF_ERROR(GrowAround(context, image));
  VEDUTA_RETURN_IF_ERROR(AdjustAround(context, photo.id, context.options.local_images_max));
  std::swap(start.placed.front(), *std::find(start.placed.begin(), start.placed.end(), photo.id));
  return start;
}

std::string NoStartDetail(const ReconstructionStart& start, size_t pair_count) {
  std::string text = std::to_string(pair_count) + " verified neighbours, none placed, and ";
  if (start.view_count < 3) return text + "three views are needed to start";
  switch (start.outcome) {
    case FoundingOutcome::kNoPair:
      return text + "no two of the views have enough parallax";
    case FoundingOutcome::kNoThirdView:
      return text + "no third view sees the points of the best pair";
    case FoundingOutcome::kUndetermined:
      return text + "what three views see does not say where each of them stands";
    case FoundingOutcome::kRepeated:
      return text + "the views show the same thing again and again";
    case FoundingOutcome::kTooFewPoints:
    case FoundingOutcome::kFounded:
      break;
  }
  return text + "too few points common to three views";
}

}  // namespace veduta
