// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a placed image belongs elsewhere, judged by all that has been mapped since it was placed.

#include <optional>
#include <span>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pair_matches.h"
#include "engine/mapping/resection.h"

namespace veduta {

// A pose that explains clearly more of the points that other images agree on than the image's own
// pose does, if there is one. An image that was placed while few of its neighbours were may sit one
// window of a facade too far to the left, and every point that it has helped to triangulate since
// agrees with the wrong pose; so only points that two other images see are asked, and they are put
// where these see them. `matches` are the image's mutual nearest neighbours with placed images,
// right or wrong. The error up to which a pose explains a point is narrower than that of `options`.
// Reads the map only. Deterministic in its inputs.
std::optional<Resection> FindBetterPose(const CityMap& map, ImageId image,
                                        std::span<const PairMatches> matches, uint64_t seed,
                                        ResectionOptions options);

// Whether the image would explain clearly more of these points from a pose near by, as far as a
// refinement of its own pose finds it: a millisecond, without sampling. `matches` are verified.
// Reads the map only.
bool IsDrawnElsewhere(const CityMap& map, ImageId image, std::span<const PairMatches> matches);

}  // namespace veduta
