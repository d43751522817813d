// SPDX-License-Identifier: Apache-2.0
#pragma once
// Points that two reconstructions have in common, and the similarity that they give (R15).

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "engine/ingest/map_loader.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

// One place known as a point in two reconstructions.
struct PointPair {
  PointId into, from;
  auto operator<=>(const PointPair&) const = default;
};

// Pairs of points that verified matches name as one place: a point of the photo's reconstruction
// and one of another. The matches are those of the `near` images, which lie in the photo's
// reconstruction, and the photo's own `pairs`, which are not stored yet. By the other
// reconstruction; pairs ascend. Loads the points that it names, with the images around them.
Result<std::map<ReconstructionId, std::vector<PointPair>>> FindCommonPoints(
    MapLoader* loader, const CityMap& map, std::span<const ImageId> near, ImageId photo,
    std::span<const PairMatches> pairs);

struct PointAlignment {
  Sim3 into_from;
  std::vector<PointPair> agreeing;
};

// The similarity under which most pairs coincide, judged in the photos: each point, carried over,
// must fall within `error_px_max` of where the first and the last image of the other point's track
// see it. Then all pairs agree that one position explains in all photos of both tracks, to the same
// error. Nothing when fewer than `count_min` distinct points of either reconstruction agree.
// Deterministic in its inputs and the seed.
std::optional<PointAlignment> AlignPoints(const CityMap& map, std::span<const PointPair> pairs,
                                          double error_px_max, uint32_t count_min, uint64_t seed);

}  // namespace veduta
