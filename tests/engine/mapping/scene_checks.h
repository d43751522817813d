// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the mapping tests ask of a map of a synthetic scene.

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {

// Each track must hold features of one true point only. Returns the number of observations.
inline size_t CheckTracks(const CityMap& map, const SyntheticScene& scene) {
  size_t observations = 0;
  for (const auto& [id, image] : map.images()) {
    for (FeatureIndex f = 0; f < image.points.size(); ++f) {
      if (!image.points[f].valid()) continue;
      ++observations;
      const PointRecord& point = map.point(image.points[f]);
      const TrackElement& first = point.track.front();
      EXPECT_EQ(scene.seen[id.value - 1][f], scene.seen[first.image.value - 1][first.feature]);
      bool listed = false;
      for (const TrackElement& e : point.track) listed |= e.image == id && e.feature == f;
      EXPECT_TRUE(listed);
    }
  }
  return observations;
}

inline MapImage Unplaced(const MapImage& image) {
  MapImage copy = image;
  copy.points.assign(image.features->size(), PointId{});
  return copy;
}

}  // namespace veduta
