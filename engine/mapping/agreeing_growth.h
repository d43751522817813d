// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tracks grown from those matches of a placed image that agree with its pose.

#include <span>
#include <vector>

#include "engine/mapping/city_map.h"
#include "engine/mapping/growth.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

// The matches of a placed image with images of its reconstruction, as far as they lie within
// `error_px_max` of the epipolar lines of the poses. The images of `putative` must be loaded.
std::vector<PairMatches> KeepAgreeing(const CityMap& map, ImageId image,
                                      std::span<const PairMatches> putative, double error_px_max);

// Grows tracks from the matches that agree (GrowFromMatches).
void GrowFromAgreeing(CityMap* map, ImageId image, std::span<const PairMatches> putative,
                      const GrowthOptions& options);

// Grows tracks from the matches that agree, then moves the image to the pose that the points which
// it sees now give: further epipolar lines are drawn from that pose.
void GrowAndRefine(CityMap* map, ImageId image, std::span<const PairMatches> putative,
                   const GrowthOptions& options);

}  // namespace veduta
