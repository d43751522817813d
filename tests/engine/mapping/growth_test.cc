// SPDX-License-Identifier: Apache-2.0
// Goal: tracks grow to what the scene holds, and points that turn out to be one are merged.
// Method: a synthetic scene; every image's features are compared with the points that they truly
//   see.
#include "engine/mapping/growth.h"

#include <gtest/gtest.h>

#include "scene_checks.h"

namespace veduta {
namespace {

TEST(Growth, MatchesBecomePointsAndTracks) {
  const SyntheticScene scene = MakeScene({});
  CityMap map;
  for (uint32_t k = 0; k < 4; ++k) {
    map.PlaceImage(Unplaced(scene.images[k]));
    std::vector<PairMatches> pairs;
    for (uint32_t j = 0; j < k; ++j)
      pairs.push_back(MatchesFrom(scene.Pair(j, k), scene.images[k].id));
    GrowFromMatches(&map, scene.images[k].id, pairs, {});
  }
  size_t visible = 0;
  for (uint32_t i = 0; i < scene.points.size(); ++i) {
    size_t views = 0;
    for (uint32_t k = 0; k < 4; ++k) views += scene.feature_of[k][i] >= 0;
    visible += views >= 2 ? views : 0;
  }
  EXPECT_GE(CheckTracks(map, scene), visible * 95 / 100);
  int64_t points = 0;
  for (const auto& [id, change] : map.changes().counts) points += change.points;
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  EXPECT_EQ(static_cast<size_t>(points), map.PointsSeenBy(ids).size());
}

TEST(Growth, SplitPointsAreMerged) {
  const SyntheticScene scene = MakeScene({});
  CityMap map;
  for (uint32_t k = 0; k < 5; ++k) map.PlaceImage(Unplaced(scene.images[k]));
  // One true point twice: seen by images 1 and 2, and by 4 and 5.
  uint32_t target = 0;
  while (scene.feature_of[0][target] < 0 || scene.feature_of[1][target] < 0 ||
         scene.feature_of[2][target] < 0 || scene.feature_of[3][target] < 0 ||
         scene.feature_of[4][target] < 0) {
    ++target;
  }
  const auto element = [&](uint32_t k) {
    return TrackElement{scene.images[k].id, static_cast<FeatureIndex>(scene.feature_of[k][target])};
  };
  const PointId one = map.AddPoint(ImageId(1), scene.points[target], {element(0), element(1)});
  const PointId two = map.AddPoint(ImageId(4), scene.points[target], {element(3), element(4)});
  std::vector<PairMatches> pairs;
  for (const uint32_t j : {0u, 1u, 3u, 4u}) {
    PairMatches pair;
    pair.other = scene.images[j].id;
    pair.matches = {{element(2).feature, element(j).feature}};
    pairs.push_back(pair);
  }
  GrowFromMatches(&map, ImageId(3), pairs, {});
  const PointRecord* kept = map.FindPoint(one) ? map.FindPoint(one) : map.FindPoint(two);
  ASSERT_NE(kept, nullptr);
  EXPECT_EQ(kept->track.size(), 5u);
  EXPECT_TRUE(map.FindPoint(one) == nullptr || map.FindPoint(two) == nullptr);
}

}  // namespace
}  // namespace veduta
