// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/misplaced.h"

#include <optional>
#include <set>

#include "engine/mapping/covisible_images.h"
#include "engine/mapping/resection.h"
#include "engine/mapping/structure_matches.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Images beside those that twins have lured that are weighed with one side of a seam, so that a
// street of twins is not walked to its end while photos wait. Chosen by hand, as many as are
// compared at once (mixed_places.h).
constexpr size_t kBesideLuredMax = 64;

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

// The points that an image sees on the other side of a seam. Loads what these pairs lead to.
Result<StructureMatches> GatherAcross(const MappingContext& context, ImageId image,
                                      std::span<const PairMatches> pairs,
                                      ReconstructionId reconstruction) {
  for (const PairMatches& pair : pairs)
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&pair.other, 1}));
  const MapImage& view = context.map->image(image);
  return GatherStructure(*context.map, reconstruction, *view.features, view.camera, pairs);
}

// How an image would stand on the other side of a seam.
struct Standing {
  Rigid3 cam_from_world;                     // set where it has a pose there
  VisibleStructure visible;                  // set where that is sure
  size_t inlier_count = 0, point_count = 0;  // of the points that it sees there
  bool is_sure = false;
};

Result<Standing> StandBy(const MappingContext& context, ImageId image,
                         const StructureMatches& structure, ReconstructionId reconstruction) {
  const MapperOptions& options = context.options;
  MapImage view = context.map->image(image);
  const Resection pose = Resect(structure.x, structure.positions, view.camera.focal_px(),
                                MixSeed(image.value, reconstruction.value), options.resection);
  Standing standing{pose.cam_from_world, {}, pose.inliers.size(), structure.x.size()};
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

// How it would stand there by the points that this place does not explain: where the other side has
// both of two twins, most of the points may lead to the wrong one.
Result<Standing> StandElsewhere(const MappingContext& context, ImageId image,
                                const StructureMatches& structure, const Standing& standing,
                                ReconstructionId reconstruction) {
  StructureMatches others;
  for (const uint32_t i :
       ListRivals(standing.cam_from_world, structure.x, structure.positions,
                  context.map->image(image).camera.focal_px(), context.options.resection)) {
    others.features.push_back(structure.features[i]);
    others.points.push_back(structure.points[i]);
    others.x.push_back(structure.x[i]);
    others.positions.push_back(structure.positions[i]);
  }
  return StandBy(context, image, others, reconstruction);
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
  VEDUTA_ASSIGN_OR_RETURN(const StructureMatches structure,
                          GatherAcross(context, image, across, other));
  VEDUTA_ASSIGN_OR_RETURN(const Standing there, StandBy(context, image, structure, other));
  if (!there.is_sure || 2 * there.inlier_count < there.point_count ||
      IsContradicted(there.visible, options))
    return none;
  return std::optional<DoubtedImage>(
      {image, std::to_string(own_matches) + " matches hold it, and " + std::to_string(matches) +
                  " lead to reconstruction " + std::to_string(other.value)});
}

// WeighSide. Whether the image is unsure because twins have lured it: the other side refutes the
// place where most points would put it, and it stands well there where the others do.
Result<bool> Weigh(const MappingContext& context, ImageId image, std::span<const PairMatches> pairs,
                   ReconstructionId other, SideDoubts* doubts) {
  const DoubtOptions& options = context.options.doubt;
  const ReconstructionId own = context.map->image(image).reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> across, PairsInto(context, pairs, other));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> beside, PairsInto(context, pairs, own));
  VEDUTA_ASSIGN_OR_RETURN(const VisibleStructure here,
                          JudgeView(context, context.map->image(image)));
  VEDUTA_ASSIGN_OR_RETURN(const StructureMatches structure,
                          GatherAcross(context, image, across, other));
  VEDUTA_ASSIGN_OR_RETURN(const Standing there, StandBy(context, image, structure, other));
  if (StandsBetter(there, here, options)) {
    doubts->misplaced.push_back({image, MissingText(here) + ", and " +
                                            std::to_string(there.visible.missing_cells) + " of " +
                                            std::to_string(there.visible.cells) +
                                            " in reconstruction " + std::to_string(other.value)});
    return false;
  }
  Standing elsewhere;
  if (there.is_sure && IsContradicted(there.visible, options)) {
    VEDUTA_ASSIGN_OR_RETURN(elsewhere, StandElsewhere(context, image, structure, there, other));
  }
  const bool is_lured = StandsAsWell(elsewhere, options);
  if (is_lured || IsContradicted(here, options) || StandsAsWell(there, options) ||
      MayStand(there, across, beside, options))
    doubts->unsure.push_back(image);
  return is_lured;
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
  return Weigh(context, image, pairs, other, doubts).status();
}

Result<SideDoubts> WeighSides(const MappingContext& context, std::span<const ImageId> images,
                              ReconstructionId own, ReconstructionId other) {
  SideDoubts doubts;
  std::vector<ImageId> asked(images.begin(), images.end());
  const size_t asked_max = asked.size() + kBesideLuredMax;
  std::set<ImageId> met(images.begin(), images.end());
  for (size_t i = 0; i < asked.size(); ++i) {
    const ImageId image = asked[i];
    VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood({&image, 1}));
    if (!context.map->HasImage(image) || context.map->image(image).reconstruction != own) continue;
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs, StoredPairs(context, image));
    VEDUTA_ASSIGN_OR_RETURN(const bool is_lured, Weigh(context, image, pairs, other, &doubts));
    if (!is_lured) continue;
    for (const ImageId beside :
         CovisibleImages(*context.map, image, context.options.doubt.images_max)) {
      if (asked.size() < asked_max && met.insert(beside).second) asked.push_back(beside);
    }
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
