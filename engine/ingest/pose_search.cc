// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/pose_search.h"

#include <algorithm>
#include <set>

#include "engine/ingest/pair_verifier.h"
#include "engine/mapping/structure_matches.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

bool IsIn(const CityMap& map, ImageId image, ReconstructionId reconstruction) {
  return map.HasImage(image) && map.image(image).reconstruction == reconstruction;
}

// Where the points alone give no pose: one by the verified geometry with the placed neighbour of
// most matches, and by the points.
void TryAlongNeighbor(const CityMap& map, const ImageFeatures& photo,
                      std::span<const PairMatches> pairs, const StructureMatches& structure,
                      const MapperOptions& options, PoseCandidate* candidate) {
  const PairMatches* best = nullptr;
  for (const PairMatches& pair : pairs) {
    if (pair.geometry != PairGeometry::kGeneral ||
        pair.matches.size() < options.neighbor_match_count_min ||
        !IsIn(map, pair.other, candidate->reconstruction)) {
      continue;
    }
    if (best == nullptr || pair.matches.size() > best->matches.size()) best = &pair;
  }
  if (best == nullptr) return;
  const Resection found = ResectAlong(
      best->other_from_photo.Inverse(), map.image(best->other).cam_from_world, structure.x,
      structure.positions, photo.camera.focal_px(), options.along_neighbor);
  if (found.outcome != ResectionOutcome::kPlaced) return;
  candidate->resection = found;
  candidate->along = best->other;
}

bool IsWeak(const CityMap& map, size_t inlier_count, std::span<const PairMatches> pairs,
            const MapperOptions& options) {
  if (inlier_count >= options.sure_inlier_count) return false;
  size_t unplaced_matches = 0;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other)) unplaced_matches += pair.matches.size();
  }
  return unplaced_matches > inlier_count;
}

PoseCandidate FindPoseIn(const CityMap& map, ReconstructionId reconstruction,
                         const ImageFeatures& photo, std::span<const PairMatches> pairs,
                         std::span<const PairMatches> putative, uint64_t seed,
                         const MapperOptions& options) {
  PoseCandidate candidate;
  candidate.reconstruction = reconstruction;
  const StructureMatches structure =
      GatherStructure(map, reconstruction, *photo.features, photo.camera, putative);
  candidate.point_count = static_cast<uint32_t>(structure.x.size());
  candidate.resection = Resect(structure.x, structure.positions, photo.camera.focal_px(),
                               MixSeed(seed, reconstruction.value), options.resection);
  if (candidate.resection.outcome != ResectionOutcome::kPlaced)
    TryAlongNeighbor(map, photo, pairs, structure, options, &candidate);
  if (candidate.resection.outcome != ResectionOutcome::kPlaced) {
    candidate.outcome = candidate.resection.outcome == ResectionOutcome::kTooFewMatches
                            ? PoseOutcome::kTooFewPoints
                            : PoseOutcome::kTooFewInliers;
    return candidate;
  }
  MapImage view = UnplacedImage(photo);
  view.cam_from_world = candidate.resection.cam_from_world;
  candidate.agreement = CheckNeighbors(map, reconstruction, view, pairs, options.agreement);
  candidate.rival_inlier_count = CountRivalInliers(
      structure.x, structure.positions, photo.camera.focal_px(), candidate.resection,
      MixSeed(seed, reconstruction.value), options.resection);
  const bool contradicts =
      static_cast<double>(candidate.agreement.contradicting_matches) >
      options.contradiction_share_max * static_cast<double>(candidate.agreement.agreeing_matches);
  candidate.outcome = contradicts ? PoseOutcome::kContradictsNeighbors : PoseOutcome::kFound;
  if (!contradicts && options.resection.IsAmbiguous(candidate.resection.inliers.size(),
                                                    candidate.rival_inlier_count))
    candidate.outcome = PoseOutcome::kAmbiguous;
  if (candidate.outcome == PoseOutcome::kFound) {
    for (const uint32_t i : candidate.resection.inliers)
      candidate.seen.emplace_back(structure.features[i], structure.points[i]);
  }
  candidate.is_weak = candidate.outcome == PoseOutcome::kFound && !candidate.along.valid() &&
                      IsWeak(map, candidate.resection.inliers.size(), pairs, options);
  return candidate;
}

std::string Of(size_t part, size_t whole) {
  return std::to_string(part) + " of " + std::to_string(whole);
}

// Says why the candidate is no sure pose. That few points are seen says less than any other reason,
// and does not replace one.
void Explain(const PoseCandidate& candidate, const MapperOptions& options, PoseSearch* search) {
  const size_t inliers = candidate.resection.inliers.size(), points = candidate.point_count;
  const std::string where =
      " points of reconstruction " + std::to_string(candidate.reconstruction.value);
  switch (candidate.outcome) {
    case PoseOutcome::kTooFewPoints:
      if (search->reason != Reason::kNone) return;
      search->reason = Reason::kTooFewStructurePoints;
      search->detail = "sees " + std::to_string(points) + where + "; " +
                       std::to_string(options.resection.inlier_count_min) + " are needed";
      return;
    case PoseOutcome::kTooFewInliers:
      search->reason = Reason::kResectionFailed;
      search->detail = inliers > 0
                           ? "no pose explains more than " + Of(inliers, points) + where
                           : "no pose explains even a few of " + std::to_string(points) + where;
      return;
    case PoseOutcome::kContradictsNeighbors:
      search->doubtful = candidate.reconstruction;
      search->reason = Reason::kContradictsNeighbors;
      search->detail =
          "the pose by " + Of(inliers, points) + where + " contradicts " +
          Of(candidate.agreement.contradicting_images,
             candidate.agreement.contradicting_images + candidate.agreement.agreeing_images) +
          " verified neighbours";
      return;
    case PoseOutcome::kAmbiguous:
      search->doubtful = candidate.reconstruction;
      search->reason = Reason::kAmbiguous;
      search->detail = "one pose agrees with " + Of(inliers, points) + where +
                       ", and quite another one with " +
                       std::to_string(candidate.rival_inlier_count);
      return;
    case PoseOutcome::kFound:
      if (!candidate.is_weak) return;
      search->reason = Reason::kTooFewStructurePoints;
      search->detail =
          "a pose by only " + Of(inliers, points) + where +
          ", while most of its verified matches lead to photos that are not placed yet";
      return;
  }
}

}  // namespace

Result<std::vector<PairMatches>> MatchPlacedNeighbors(const MappingContext& context,
                                                      const ImageFeatures& photo,
                                                      std::span<const PairMatches> pairs) {
  std::vector<PairMatches> putative;
  for (const PairMatches& pair : pairs) {
    if (context.map->HasImage(pair.other))
      putative.push_back({pair.other, pair.geometry, pair.other_from_photo, {}});
  }
  std::vector<Status> statuses(putative.size());
  context.pool->ParallelFor(putative.size(), [&](size_t i) {
    const auto other =
        context.loader->features()->Get(context.loader->snapshot(), putative[i].other);
    if (!other.ok()) {
      statuses[i] = other.status();
      return;
    }
    MatchOptions match;
    match.ratio_max = context.options.putative_ratio_max;
    for (const DescriptorMatch& m : MatchImages(photo, **other, match)) {
      putative[i].matches.push_back({m.a, m.b});
    }
  });
  for (const Status& status : statuses) VEDUTA_RETURN_IF_ERROR(status);
  return putative;
}

PoseSearch FindPoses(const CityMap& map, const ImageFeatures& photo,
                     std::span<const PairMatches> pairs, std::span<const PairMatches> putative,
                     uint64_t seed, const MapperOptions& options) {
  std::set<ReconstructionId> reconstructions;
  for (const PairMatches& pair : pairs) {
    if (map.HasImage(pair.other)) reconstructions.insert(map.image(pair.other).reconstruction);
  }
  PoseSearch search;
  for (const ReconstructionId id : reconstructions) {
    PoseCandidate candidate = FindPoseIn(map, id, photo, pairs, putative, seed, options);
    Explain(candidate, options, &search);
    if (candidate.outcome == PoseOutcome::kFound) search.found.push_back(std::move(candidate));
  }
  std::stable_sort(
      search.found.begin(), search.found.end(), [](const PoseCandidate& a, const PoseCandidate& b) {
        return a.is_weak != b.is_weak ? b.is_weak
                                      : a.resection.inliers.size() > b.resection.inliers.size();
      });
  return search;
}

bool IsGoodEnough(const PoseCandidate& candidate, const MapperOptions& options) {
  const size_t inliers = candidate.resection.inliers.size();
  return !candidate.is_weak ||
         (inliers >= options.weak_inlier_count_min &&
          static_cast<double>(inliers) >= options.weak_inlier_share_min * candidate.point_count);
}

}  // namespace veduta
