// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/misplaced.h"

#include <optional>

#include "engine/mapping/covisible_images.h"
#include "engine/mapping/resection.h"
#include "engine/mapping/structure_matches.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

Result<std::vector<PairMatches>> StoredPairs(const MappingContext& context, ImageId image) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          context.loader->snapshot().ListNeighbors(image));
  std::vector<PairMatches> pairs;
  for (const PairNeighbor& neighbor : neighbors) {
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored,
                            context.loader->GetPair(image, neighbor.image));
    pairs.push_back(MatchesFrom(stored, image));
  }
  return pairs;
}

// Those of the pairs that lead to images of the reconstruction, which are loaded.
Result<std::vector<PairMatches>> PairsInto(const MappingContext& context,
                                           std::span<const PairMatches> pairs,
                                           ReconstructionId reconstruction) {
  std::vector<PairMatches> into;
  for (const PairMatches& pair : pairs) {
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadImages({&pair.other, 1}));
    if (!context.map->HasImage(pair.other) ||
        context.map->image(pair.other).reconstruction != reconstruction)
      continue;
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&pair.other, 1}));
    into.push_back(pair);
  }
  return into;
}

// How an image would stand on the other side of a seam.
struct Standing {
  VisibleStructure visible;
  size_t inlier_count = 0, point_count = 0;  // of the points that it sees there
};

// How the image would stand in that reconstruction; nothing where it has no sure pose there.
Result<std::optional<Standing>> StandIn(const MappingContext& context, ImageId image,
                                        std::span<const PairMatches> all,
                                        ReconstructionId reconstruction) {
  const MapperOptions& options = context.options;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs,
                          PairsInto(context, all, reconstruction));
  const CityMap& map = *context.map;
  MapImage view = map.image(image);
  const StructureMatches structure =
      GatherStructure(map, reconstruction, *view.features, view.camera, pairs);
  const Resection pose = Resect(structure.x, structure.positions, view.camera.focal_px(),
                                MixSeed(image.value, reconstruction.value), options.resection);
  if (pose.outcome != ResectionOutcome::kPlaced || pose.inliers.size() < options.sure_inlier_count)
    return std::optional<Standing>();
  view.reconstruction = reconstruction;
  view.cam_from_world = pose.cam_from_world;
  view.points.assign(view.points.size(), PointId{});
  for (const uint32_t i : pose.inliers) view.points[structure.features[i]] = structure.points[i];
  VEDUTA_ASSIGN_OR_RETURN(const VisibleStructure visible, JudgeView(context, view));
  return std::optional(Standing{visible, pose.inliers.size(), structure.x.size()});
}

bool StandsBetter(const Standing& there, const VisibleStructure& here,
                  const DoubtOptions& options) {
  return here.cells < options.better_cells_min ? FitsWell(there.visible, options)
                                               : IsClearlyBetter(there.visible, here, options);
}

bool StandsAsWell(const Standing& there, const DoubtOptions& options) {
  return there.inlier_count >= options.either_side_points_min &&
         static_cast<double>(there.inlier_count) >=
             options.either_side_share_min * static_cast<double>(there.point_count) &&
         !IsContradicted(there.visible, options);
}

}  // namespace

Result<VisibleStructure> JudgeView(const MappingContext& context, const MapImage& view) {
  const DoubtOptions& options = context.options.doubt;
  const std::vector<ImageId> around = CovisibleImages(*context.map, view, options.images_max);
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(around));
  return FindAround(*context.map, view, around, options);
}

bool TellsPlacesApart(RefusalReason reason) {
  return reason == RefusalReason::kMissingStructure || reason == RefusalReason::kContradicted;
}

Status WeighSide(const MappingContext& context, ImageId image, std::span<const PairMatches> pairs,
                 ReconstructionId other, SideDoubts* doubts) {
  const DoubtOptions& options = context.options.doubt;
  VEDUTA_ASSIGN_OR_RETURN(const VisibleStructure here,
                          JudgeView(context, context.map->image(image)));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<Standing> there,
                          StandIn(context, image, pairs, other));
  if (there && StandsBetter(*there, here, options)) {
    doubts->misplaced.push_back({image, MissingText(here) + ", and " +
                                            std::to_string(there->visible.missing_cells) + " of " +
                                            std::to_string(there->visible.cells) +
                                            " in reconstruction " + std::to_string(other.value)});
  } else if (IsContradicted(here, options) || (there && StandsAsWell(*there, options))) {
    doubts->unsure.push_back(image);
  }
  return Status::Ok();
}

Result<SideDoubts> WeighSides(const MappingContext& context, std::span<const ImageId> images,
                              ReconstructionId own, ReconstructionId other) {
  SideDoubts doubts;
  for (const ImageId image : images) {
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&image, 1}));
    if (!context.map->HasImage(image) || context.map->image(image).reconstruction != own) continue;
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs, StoredPairs(context, image));
    VEDUTA_RETURN_IF_ERROR(WeighSide(context, image, pairs, other, &doubts));
  }
  return doubts;
}

}  // namespace veduta
