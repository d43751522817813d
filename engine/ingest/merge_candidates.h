// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the view graph offers a mapper beyond one photo's own pairs: points common to two
// reconstructions, and the views that could found one.

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "engine/ingest/map_loader.h"
#include "engine/mapping/founding.h"
#include "engine/mapping/placement.h"

namespace veduta {

// One place known as a point in two reconstructions.
struct PointPair {
  PointId into, from;
  auto operator<=>(const PointPair&) const = default;
};

// What verified matches name as points of `into` and of another reconstruction: by the pairs of the
// images `near`, all of `into`, and by `pairs` of `photo`, which are not stored yet. Ascending, by
// the other reconstruction. Loads what it names, with the images around.
Result<std::map<ReconstructionId, std::vector<PointPair>>> FindCommonPoints(
    MapLoader* loader, const Map& map, std::span<const ImageId> near, ImageId photo,
    std::span<const PairMatches> pairs);

struct PointAlignment {
  Sim3 into_from;
  std::vector<PointPair> agreeing;
};

// The similarity under which most pairs coincide, judged in the photos: each point, carried over,
// must fall within `error_px_max` of where the other is seen. Nothing with fewer than `count_min`
// distinct points agreeing.
std::optional<PointAlignment> AlignPoints(const Map& map, std::span<const PointPair> pairs,
                                          double error_px_max, uint32_t count_min, uint64_t seed);

// The photo, its neighbours without a pose (most matches first, up to `count_max` views in all) and
// the stored pairs among them.
Result<FoundingViews> GatherFoundingViews(MapLoader* loader, const Map& map,
                                          const ImageFeatures& photo,
                                          std::span<const PairMatches> pairs, uint32_t count_max);

}  // namespace veduta
