// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/structure_matches.h"

#include <algorithm>
#include <map>

namespace veduta {
namespace {

// How many neighbours say that a feature sees a point.
using Votes = std::map<FeatureIndex, std::map<PointId, uint32_t>>;

Votes CountVotes(const CityMap& map, ReconstructionId reconstruction,
                 std::span<const PairMatches> pairs,
                 const std::function<bool(const PointRecord&)>& accept) {
  Votes votes;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction != reconstruction)
      continue;
    const MapImage& other = map.image(pair.other);
    for (const FeatureMatch& match : pair.matches) {
      const PointId point = other.points[match.b];
      const PointRecord* record = point.valid() ? map.FindPoint(point) : nullptr;
      if (record != nullptr && (!accept || accept(*record))) ++votes[match.a][point];
    }
  }
  return votes;
}

}  // namespace

StructureMatches GatherStructure(const CityMap& map, ReconstructionId reconstruction,
                                 const Features& features, const Pinhole& camera,
                                 std::span<const PairMatches> pairs,
                                 const std::function<bool(const PointRecord&)>& accept) {
  struct Entry {
    uint32_t votes;
    FeatureIndex feature;
    PointId point;
  };
  std::vector<Entry> entries;
  for (const auto& [feature, points] : CountVotes(map, reconstruction, pairs, accept)) {
    Entry best{0, feature, {}};
    for (const auto& [point, count] : points) {
      if (count > best.votes) best = {count, feature, point};
    }
    entries.push_back(best);
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.votes > b.votes; });
  StructureMatches found;
  for (const Entry& entry : entries) {
    found.features.push_back(entry.feature);
    found.points.push_back(entry.point);
    found.x.push_back(camera.Normalize(features.keypoints[entry.feature]));
    found.positions.push_back(map.point(entry.point).position);
  }
  return found;
}

}  // namespace veduta
