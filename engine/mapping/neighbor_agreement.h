// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a photo's verified neighbours agree with the pose that was found for it (R14).

#include <cstdint>
#include <span>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

struct NeighborAgreement {
  uint32_t agreeing_images = 0, contradicting_images = 0;
  uint64_t agreeing_matches = 0, contradicting_matches = 0;
};

// Counts the placed neighbours in `reconstruction` whose verified matches the pose explains, and
// those that it contradicts. A pose explains a neighbour when at least half of the matches lie
// within `error_px_max` of their epipolar lines. Repeated facades bring contradictions about.
// Neighbours seen by a rotation alone have no epipolar lines and are not counted.
NeighborAgreement CheckNeighbors(const CityMap& map, ReconstructionId reconstruction,
                                 const Rigid3& cam_from_world, const Features& features,
                                 const Pinhole& camera, std::span<const PairMatches> pairs,
                                 double error_px_max);

}  // namespace veduta
