// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds the pose of a photo in the reconstructions that its verified neighbours belong to (R14).

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/ingest/mapping_context.h"
#include "engine/mapping/neighbor_agreement.h"
#include "engine/mapping/pair_matches.h"
#include "engine/mapping/resection.h"

namespace veduta {

enum class PoseOutcome : uint8_t {
  kFound,
  kTooFewPoints,          // the photo sees too few points of the reconstruction
  kTooFewInliers,         // no pose explains enough of them
  kContradictsNeighbors,  // the pose contradicts too many verified matches
  kAmbiguous,             // quite another pose explains nearly as many points
};

// The pose of the photo in one reconstruction.
struct PoseCandidate {
  ReconstructionId reconstruction;
  PoseOutcome outcome = PoseOutcome::kTooFewPoints;
  Resection resection;
  std::vector<std::pair<FeatureIndex, PointId>> seen;  // that agree with the pose; kFound only
  uint32_t point_count = 0;         // points of the reconstruction that the photo sees
  uint32_t rival_inlier_count = 0;  // points that the best of quite other poses explains
  NeighborAgreement agreement;      // set unless there is no pose
  // The neighbour along whose baseline the pose was sought, because the points alone gave none; or
  // not valid().
  ImageId along;
  // The pose rests on few points, while more of the photo's verified matches lead to photos without
  // a pose. The photo rather founds with those: a few points may agree on repeated texture alone.
  bool is_weak = false;
};

struct PoseSearch {
  std::vector<PoseCandidate> found;  // sure ones first, then by inliers; kFound only
  // Why there is no pose, or no sure one; kNone when no neighbour is placed.
  Reason reason = Reason::kNone;
  std::string detail;
  // A reconstruction in which many points agree with a pose that is refused all the same: verified
  // neighbours contradict it, or quite another pose is nearly as good. Not valid() where there is
  // none.
  ReconstructionId doubtful;
};

// Matches the photo with those images of the pairs that are placed: all mutual nearest neighbours,
// right or wrong. Among repeated windows, the verified matches of a pair may be the wrong ones that
// fit its geometry. Spread over the pool; the result does not depend on it.
Result<std::vector<PairMatches>> MatchPlacedNeighbors(const MappingContext& context,
                                                      const ImageFeatures& photo,
                                                      std::span<const PairMatches> pairs);

// A pose in each reconstruction of a placed neighbour. `pairs` are the verified matches, `putative`
// those of MatchPlacedNeighbors. The neighbours must be loaded with their points. Reads the map
// only. Deterministic in its inputs and the seed.
PoseSearch FindPoses(const CityMap& map, const ImageFeatures& photo,
                     std::span<const PairMatches> pairs, std::span<const PairMatches> putative,
                     uint64_t seed, const MapperOptions& options);

// Whether a weak pose has enough points to be taken where nothing could be founded; a sure one has.
bool IsGoodEnough(const PoseCandidate& candidate, const MapperOptions& options);

}  // namespace veduta
