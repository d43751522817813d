// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which points of a reconstruction a photo sees, by its matches with images that are placed there
// (R14).

#include <functional>
#include <span>
#include <vector>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

struct StructureMatches {
  std::vector<FeatureIndex> features;
  std::vector<PointId> points;
  std::vector<Eigen::Vector2d> x;          // normalised coordinates of the features
  std::vector<Eigen::Vector3d> positions;  // of the points
};

// The photo's features that match features with a point in `reconstruction`: one point for each
// feature, the one that most neighbours name. Features with most votes come first, and among equal
// votes the strongest features. Neighbours must be loaded with their points. `accept`, where given,
// says which points count. O(matches * log).
StructureMatches GatherStructure(const CityMap& map, ReconstructionId reconstruction,
                                 const Features& features, const Pinhole& camera,
                                 std::span<const PairMatches> pairs,
                                 const std::function<bool(const PointRecord&)>& accept = {});

}  // namespace veduta
