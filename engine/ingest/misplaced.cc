// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/misplaced.h"

#include <optional>

#include "engine/mapping/covisible_images.h"
#include "engine/mapping/resection.h"
#include "engine/mapping/structure_matches.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// The image's verified pairs with images of the reconstruction, which are loaded.
Result<std::vector<PairMatches>> PairsInto(const MappingContext& context, ImageId image,
                                           ReconstructionId reconstruction) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          context.loader->snapshot().ListNeighbors(image));
  std::vector<PairMatches> pairs;
  for (const PairNeighbor& neighbor : neighbors) {
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadImages({&neighbor.image, 1}));
    if (!context.map->HasImage(neighbor.image) ||
        context.map->image(neighbor.image).reconstruction != reconstruction)
      continue;
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&neighbor.image, 1}));
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored,
                            context.loader->GetPair(image, neighbor.image));
    pairs.push_back(MatchesFrom(stored, image));
  }
  return pairs;
}

// What the image would lack in that reconstruction; nothing where it has no sure pose there.
Result<std::optional<VisibleStructure>> JudgeIn(const MappingContext& context, ImageId image,
                                                ReconstructionId reconstruction) {
  const MapperOptions& options = context.options;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs,
                          PairsInto(context, image, reconstruction));
  const CityMap& map = *context.map;
  MapImage view = map.image(image);
  const StructureMatches structure =
      GatherStructure(map, reconstruction, *view.features, view.camera, pairs);
  const Resection pose = Resect(structure.x, structure.positions, view.camera.focal_px(),
                                MixSeed(image.value, reconstruction.value), options.resection);
  if (pose.outcome != ResectionOutcome::kPlaced || pose.inliers.size() < options.sure_inlier_count)
    return std::optional<VisibleStructure>();
  view.reconstruction = reconstruction;
  view.cam_from_world = pose.cam_from_world;
  view.points.assign(view.points.size(), PointId{});
  for (const uint32_t i : pose.inliers) view.points[structure.features[i]] = structure.points[i];
  VEDUTA_ASSIGN_OR_RETURN(const VisibleStructure visible, JudgeView(context, view));
  return std::optional(visible);
}

}  // namespace

Result<VisibleStructure> JudgeView(const MappingContext& context, const MapImage& view) {
  const DoubtOptions& options = context.options.doubt;
  const std::vector<ImageId> around = CovisibleImages(*context.map, view, options.images_max);
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(around));
  return FindAround(*context.map, view, around, options);
}

Result<std::vector<DoubtedImage>> FindMisplaced(const MappingContext& context,
                                                std::span<const ImageId> images,
                                                ReconstructionId own, ReconstructionId other) {
  const DoubtOptions& options = context.options.doubt;
  std::vector<DoubtedImage> misplaced;
  for (const ImageId image : images) {
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&image, 1}));
    if (!context.map->HasImage(image) || context.map->image(image).reconstruction != own) continue;
    VEDUTA_ASSIGN_OR_RETURN(const VisibleStructure here,
                            JudgeView(context, context.map->image(image)));
    const bool knows_little = here.cells < options.better_cells_min;
    if (!knows_little && here.missing_cells < options.better_missing_cells_min) continue;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<VisibleStructure> there,
                            JudgeIn(context, image, other));
    if (!there ||
        !(knows_little ? FitsWell(*there, options) : IsClearlyBetter(*there, here, options)))
      continue;
    misplaced.push_back({image, MissingText(here) + ", and " +
                                    std::to_string(there->missing_cells) + " of " +
                                    std::to_string(there->cells) + " in reconstruction " +
                                    std::to_string(other.value)});
  }
  return misplaced;
}

}  // namespace veduta
