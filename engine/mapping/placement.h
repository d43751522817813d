// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether and where a photo fits into a reconstruction that its verified neighbours belong to
// (R14), and whether the other neighbours agree.

#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/map.h"
#include "engine/mapping/resection.h"
#include "storage/base/transform.h"
#include "storage/model/pair.h"

namespace veduta {

// Verified matches of the photo at hand with one other image.
struct PairMatches {
  ImageId other;
  PairGeometry geometry = PairGeometry::kGeneral;
  Rigid3 other_from_photo;            // translation of unit length
  std::vector<FeatureMatch> matches;  // a: feature of the photo at hand; b: feature of `other`
};

// The record as seen from `image`, which must be one of its two.
PairMatches MatchesFrom(const PairRecord& pair, ImageId image);
// The inverse.
PairRecord RecordOf(const PairMatches& pair, ImageId photo);

struct StructureMatches {
  std::vector<FeatureIndex> features;
  std::vector<PointId> points;
  std::vector<Eigen::Vector2d> x;          // normalised coordinates of the features
  std::vector<Eigen::Vector3d> positions;  // of the points
};

// Features of the photo that match features with a point in `reconstruction`: one point a feature,
// that which most neighbours name; most votes first, then strongest feature first. Neighbours must
// be loaded with their points.
StructureMatches GatherStructure(const Map& map, ReconstructionId reconstruction,
                                 const Features& features, const Pinhole& camera,
                                 std::span<const PairMatches> pairs);

struct NeighborAgreement {
  uint32_t agreeing_images = 0, contradicting_images = 0;
  uint64_t agreeing_matches = 0, contradicting_matches = 0;
};

// Counts the placed neighbours in `reconstruction` whose verified matches the pose explains (at
// least half of them within `error_px_max` of their epipolar lines), and those it contradicts: what
// repeated facades bring about.
NeighborAgreement CheckNeighbors(const Map& map, ReconstructionId reconstruction,
                                 const Rigid3& cam_from_world, const Features& features,
                                 const Pinhole& camera, std::span<const PairMatches> pairs,
                                 double error_px_max);

// A pose that explains clearly more of the points that other images agree on than the image's own,
// if there is one: an image that was placed when its neighbourhood was thin may sit a window too
// far to the left, and all that it has measured since agrees with that. `matches` are the image's
// putative ones with placed images. Reads the map only.
std::optional<Resection> FindBetterPose(const Map& map, ImageId image,
                                        std::span<const PairMatches> matches, uint64_t seed,
                                        const ResectionOptions& options);

}  // namespace veduta
