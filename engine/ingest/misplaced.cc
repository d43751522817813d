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

// Those of the pairs that lead to images of the reconstruction. Loads the images.
Result<std::vector<PairMatches>> PairsInto(const MappingContext& context,
                                           std::span<const PairMatches> pairs,
                                           ReconstructionId reconstruction) {
  std::vector<PairMatches> into;
  for (const PairMatches& pair : pairs) {
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadImages({&pair.other, 1}));
    if (!context.map->HasImage(pair.other) ||
        context.map->image(pair.other).reconstruction != reconstruction)
      continue;
    into.push_back(pair);
  }
  return into;
}

// How an image would stand on the other side of a seam.
struct Standing {
  VisibleStructure visible;                  // set where it has a sure pose there
  size_t inlier_count = 0, point_count = 0;  // of the points that it sees there
  bool is_sure = false;
};

Result<Standing> StandIn(const MappingContext& context, ImageId image,
                         std::span<const PairMatches> pairs, ReconstructionId reconstruction) {
  const MapperOptions& options = context.options;
  for (const PairMatches& pair : pairs)
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&pair.other, 1}));
  const CityMap& map = *context.map;
  MapImage view = map.image(image);
  const StructureMatches structure =
      GatherStructure(map, reconstruction, *view.features, view.camera, pairs);
  const Resection pose = Resect(structure.x, structure.positions, view.camera.focal_px(),
                                MixSeed(image.value, reconstruction.value), options.resection);
  Standing standing{{}, pose.inliers.size(), structure.x.size()};
  standing.is_sure =
      pose.outcome == ResectionOutcome::kPlaced && pose.inliers.size() >= options.sure_inlier_count;
  if (!standing.is_sure) return standing;
  view.reconstruction = reconstruction;
  view.cam_from_world = pose.cam_from_world;
  view.points.assign(view.points.size(), PointId{});
  for (const uint32_t i : pose.inliers) view.points[structure.features[i]] = structure.points[i];
  VEDUTA_ASSIGN_OR_RETURN(standing.visible, JudgeView(context, view));
  return standing;
}

bool StandsBetter(const Standing& there, const VisibleStructure& here,
                  const DoubtOptions& options) {
  if (!there.is_sure) return false;
  return here.cells < options.better_cells_min ? FitsWell(there.visible, options)
                                               : IsClearlyBetter(there.visible, here, options);
}

bool StandsAsWell(const Standing& there, const DoubtOptions& options) {
  return there.is_sure && there.inlier_count >= options.either_side_points_min &&
         static_cast<double>(there.inlier_count) >=
             options.either_side_share_min * static_cast<double>(there.point_count) &&
         !IsContradicted(there.visible, options);
}

size_t CountMatches(std::span<const PairMatches> pairs) {
  size_t count = 0;
  for (const PairMatches& pair : pairs) count += pair.matches.size();
  return count;
}

// Whether the pairs across are as strong, on average, as those of its own side, while too few of
// the points there are known to weigh them.
bool MayStand(const Standing& there, std::span<const PairMatches> across,
              std::span<const PairMatches> beside, const DoubtOptions& options) {
  const size_t matches = CountMatches(across);
  return there.point_count < options.either_side_points_min &&
         matches >= options.either_side_matches_min &&
         matches * beside.size() >= CountMatches(beside) * across.size();
}

// The image, where the other side outweighs the one on which it stands.
Result<std::optional<DoubtedImage>> Outweigh(const MappingContext& context, ImageId image,
                                             ReconstructionId other) {
  const DoubtOptions& options = context.options.doubt;
  const std::optional<DoubtedImage> none;
  const MapImage& here = context.map->image(image);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs, StoredPairs(context, image));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> across, PairsInto(context, pairs, other));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> beside,
                          PairsInto(context, pairs, here.reconstruction));
  const size_t matches = CountMatches(across), own_matches = CountMatches(beside);
  if (static_cast<double>(matches) < options.outweighing_factor * static_cast<double>(own_matches))
    return none;
  VEDUTA_ASSIGN_OR_RETURN(const Standing there, StandIn(context, image, across, other));
  if (!there.is_sure || 2 * there.inlier_count < there.point_count ||
      IsContradicted(there.visible, options))
    return none;
  return std::optional<DoubtedImage>(
      {image, std::to_string(own_matches) + " matches hold it, and " + std::to_string(matches) +
                  " lead to reconstruction " + std::to_string(other.value)});
}

}  // namespace

Result<VisibleStructure> JudgeView(const MappingContext& context, const MapImage& view) {
  const DoubtOptions& options = context.options.doubt;
  const std::vector<ImageId> around = CovisibleImages(*context.map, view, options.images_max);
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(around));
  return FindAround(*context.map, view, around, options);
}

Status WeighSide(const MappingContext& context, ImageId image, std::span<const PairMatches> pairs,
                 ReconstructionId other, SideDoubts* doubts) {
  const DoubtOptions& options = context.options.doubt;
  const ReconstructionId own = context.map->image(image).reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> across, PairsInto(context, pairs, other));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> beside, PairsInto(context, pairs, own));
  VEDUTA_ASSIGN_OR_RETURN(const VisibleStructure here,
                          JudgeView(context, context.map->image(image)));
  VEDUTA_ASSIGN_OR_RETURN(const Standing there, StandIn(context, image, across, other));
  if (StandsBetter(there, here, options)) {
    doubts->misplaced.push_back({image, MissingText(here) + ", and " +
                                            std::to_string(there.visible.missing_cells) + " of " +
                                            std::to_string(there.visible.cells) +
                                            " in reconstruction " + std::to_string(other.value)});
  } else if (IsContradicted(here, options) || StandsAsWell(there, options) ||
             MayStand(there, across, beside, options)) {
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

Result<std::vector<DoubtedImage>> FindOutweighed(const MappingContext& context,
                                                 std::span<const ImageId> images,
                                                 ReconstructionId own, ReconstructionId other) {
  std::vector<DoubtedImage> outweighed;
  size_t own_count = 0;
  for (const ImageId image : images) {
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&image, 1}));
    if (!context.map->HasImage(image) || context.map->image(image).reconstruction != own) continue;
    ++own_count;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<DoubtedImage> found,
                            Outweigh(context, image, other));
    if (found) outweighed.push_back(*found);
  }
  if (3 * outweighed.size() > own_count) outweighed.clear();
  return outweighed;
}

}  // namespace veduta
