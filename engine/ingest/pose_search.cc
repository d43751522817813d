// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/pose_search.h"

#include <algorithm>
#include <set>

#include "engine/ingest/pair_verifier.h"
#include "engine/mapping/joint_pose.h"
#include "engine/mapping/pose_deviation.h"
#include "engine/mapping/structure_matches.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Errors beyond which points and matches lose weight where both are asked for the pose. Chosen by
// hand; not measured.
constexpr double kJointErrorPx = 1.2;
// Of the points that the pose by them alone explains, the share that the pose by both must explain:
// matches of wrong neighbours are not to outvote the points. Chosen by hand; not measured.
constexpr double kJointInlierShareMin = 0.5;

bool IsIn(const CityMap& map, ImageId image, ReconstructionId reconstruction) {
  return map.HasImage(image) && map.image(image).reconstruction == reconstruction;
}

// The placed neighbour of most matches whose verified geometry is general; null where none has so
// many.
const PairMatches* StrongestNeighbor(const CityMap& map, ReconstructionId reconstruction,
                                     std::span<const PairMatches> pairs, size_t match_count_min) {
  const PairMatches* best = nullptr;
  for (const PairMatches& pair : pairs) {
    if (pair.geometry != PairGeometry::kGeneral || pair.matches.size() < match_count_min ||
        !IsIn(map, pair.other, reconstruction))
      continue;
    if (best == nullptr || pair.matches.size() > best->matches.size()) best = &pair;
  }
  return best;
}

// Seeks the pose along the baseline to `neighbor`, whose length the points give.
Resection ResectAlongNeighbor(const CityMap& map, const ImageFeatures& photo,
                              const PairMatches& neighbor, const StructureMatches& structure,
                              const MapperOptions& options) {
  return ResectAlong(neighbor.other_from_photo.Inverse(), map.image(neighbor.other).cam_from_world,
                     structure.x, structure.positions, photo.camera.focal_px(),
                     options.along_neighbor);
}

// Replaces a candidate without a pose by one along the strongest neighbour's baseline.
void TryAlongNeighbor(const CityMap& map, const ImageFeatures& photo,
                      std::span<const PairMatches> pairs, const StructureMatches& structure,
                      const MapperOptions& options, PoseCandidate* candidate) {
  const PairMatches* const best =
      StrongestNeighbor(map, candidate->reconstruction, pairs, options.neighbor_match_count_min);
  if (best == nullptr) return;
  const Resection found = ResectAlongNeighbor(map, photo, *best, structure, options);
  if (found.outcome != ResectionOutcome::kPlaced) return;
  candidate->resection = found;
  candidate->along = best->other;
}

std::vector<PlacedMatches> GatherMatches(const CityMap& map, ReconstructionId reconstruction,
                                         const ImageFeatures& photo,
                                         std::span<const PairMatches> pairs) {
  std::vector<PlacedMatches> gathered;
  for (const PairMatches& pair : pairs) {
    if (pair.geometry == PairGeometry::kRotation || !IsIn(map, pair.other, reconstruction))
      continue;
    const MapImage& other = map.image(pair.other);
    PlacedMatches& matches = gathered.emplace_back();
    matches.cam_from_world = other.cam_from_world;
    matches.scale = kJointErrorPx / std::min(photo.camera.focal_px(), other.camera.focal_px());
    for (const FeatureMatch& match : pair.matches) {
      matches.x.push_back(photo.camera.Normalize(photo.features->keypoints[match.a]));
      matches.x_other.push_back(other.camera.Normalize(other.features->keypoints[match.b]));
    }
  }
  return gathered;
}

// Where the points alone say too little of where the photo stands, its verified neighbours are
// asked as well, from the pose by the points and from that along the strongest neighbour.
void RefineByNeighbors(const CityMap& map, const ImageFeatures& photo,
                       std::span<const PairMatches> pairs, const StructureMatches& structure,
                       const MapperOptions& options, PoseCandidate* candidate) {
  std::vector<Eigen::Vector3d> agreeing;
  for (const uint32_t i : candidate->resection.inliers) agreeing.push_back(structure.positions[i]);
  if (DeviationShare(candidate->resection.cam_from_world, agreeing) <= options.deviation_share_max)
    return;
  const std::vector<PlacedMatches> neighbors =
      GatherMatches(map, candidate->reconstruction, photo, pairs);
  if (neighbors.empty()) return;
  const double focal_px = photo.camera.focal_px();
  const auto refine = [&](const Rigid3& start) {
    return RefineJointly(start, structure.x, structure.positions, neighbors,
                         kJointErrorPx / focal_px);
  };
  JointPose best = refine(candidate->resection.cam_from_world);
  const PairMatches* const strongest = StrongestNeighbor(map, candidate->reconstruction, pairs, 0);
  if (strongest != nullptr) {
    const Resection along = ResectAlongNeighbor(map, photo, *strongest, structure, options);
    if (along.outcome == ResectionOutcome::kPlaced) {
      const JointPose other = refine(along.cam_from_world);
      if (other.cost < best.cost) best = other;
    }
  }
  Resection found =
      JudgePose(best.cam_from_world, structure.x, structure.positions, focal_px,
                candidate->along.valid() ? options.along_neighbor : options.resection);
  const double inliers_min =
      kJointInlierShareMin * static_cast<double>(candidate->resection.inliers.size());
  if (found.outcome == ResectionOutcome::kPlaced &&
      static_cast<double>(found.inliers.size()) >= inliers_min)
    candidate->resection = std::move(found);
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
  RefineByNeighbors(map, photo, pairs, structure, options, &candidate);
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
      putative.push_back({pair.other, pair.geometry, pair.other_from_photo, {}, {}, {}});
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
