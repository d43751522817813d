// SPDX-License-Identifier: Apache-2.0
// Goal: the images that share points with one are ranked by how many they share.
// Method: a synthetic scene of many cameras; the ranking is compared with one by a loop over all
//   pairs of images.
#include "engine/mapping/covisible_images.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "scene_checks.h"

namespace veduta {
namespace {

// Most shared points first, and of two with as many the lower id.
std::vector<ImageId> RankPlainly(const CityMap& map, ImageId image) {
  std::vector<std::pair<int, ImageId>> ranked;
  for (const auto& [other, unused] : map.images()) {
    int shared = 0;
    for (const PointId id : map.image(image).points) {
      if (!id.valid()) continue;
      for (const TrackElement& element : map.point(id).track) shared += element.image == other;
    }
    if (other != image && shared > 0) ranked.emplace_back(-shared, other);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<ImageId> images;
  for (const auto& [shared, id] : ranked) images.push_back(id);
  return images;
}

TEST(CovisibleImages, RanksByCommonPoints) {
  const CityMap map = MakeMap(MakeScene({.camera_count = 20, .point_count = 100, .arc_deg = 120}));
  for (const auto& [id, image] : map.images()) {
    std::vector<ImageId> expected = RankPlainly(map, id);
    ASSERT_GE(expected.size(), 5u);
    EXPECT_EQ(CovisibleImages(map, id, 100), expected);
    expected.resize(5);
    EXPECT_EQ(CovisibleImages(map, id, 5), expected);
  }
}

}  // namespace
}  // namespace veduta
