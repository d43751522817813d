// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/neighbor_agreement.h"

#include <algorithm>

#include "engine/matching/two_view.h"

namespace veduta {

NeighborAgreement CheckNeighbors(const CityMap& map, ReconstructionId reconstruction,
                                 const Rigid3& cam_from_world, const Features& features,
                                 const Pinhole& camera, std::span<const PairMatches> pairs,
                                 double error_px_max) {
  NeighborAgreement agreement;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction != reconstruction)
      continue;
    if (pair.geometry == PairGeometry::kRotation) continue;
    const MapImage& other = map.image(pair.other);
    const Rigid3 other_from_cam = other.cam_from_world * cam_from_world.Inverse();
    const Eigen::Matrix3d essential = EssentialFromPose(other_from_cam);
    const double distance_max = error_px_max / std::min(camera.focal_px(), other.camera.focal_px());
    uint64_t explained = 0;
    for (const FeatureMatch& match : pair.matches) {
      explained += SampsonDistance(essential, camera.Normalize(features.keypoints[match.a]),
                                   other.camera.Normalize(other.features->keypoints[match.b])) <
                   distance_max;
    }
    const bool agrees = 2 * explained >= pair.matches.size();
    ++(agrees ? agreement.agreeing_images : agreement.contradicting_images);
    (agrees ? agreement.agreeing_matches : agreement.contradicting_matches) += pair.matches.size();
  }
  return agreement;
}

}  // namespace veduta
