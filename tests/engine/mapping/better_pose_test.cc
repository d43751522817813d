// SPDX-License-Identifier: Apache-2.0
// Goal: an image that stands wrong gets its true pose back, and one that stands right keeps its
//   own.
// Method: a synthetic scene; one image's pose is shifted and its points are let go.
#include "engine/mapping/better_pose.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

TEST(BetterPose, IsFoundOnlyForAnImageThatStandsWrong) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  const ImageId id = ImageId(3), self[] = {id};
  std::vector<PairMatches> matches;
  for (const uint32_t j : {0u, 1u}) matches.push_back(MatchesFrom(scene.Pair(j, 2), id));
  for (const uint32_t j : {3u, 4u}) matches.push_back(MatchesFrom(scene.Pair(2, j), id));
  EXPECT_FALSE(FindBetterPose(map, id, matches, 1, {}).has_value());
  EXPECT_FALSE(IsDrawnElsewhere(map, id, matches));
  for (const PointId point : map.PointsSeenBy(self)) map.RemoveObservation(point, id);
  Rigid3 shifted = scene.poses[2];
  shifted.translation.x() += 0.4;
  map.SetPose(id, shifted);
  const auto better = FindBetterPose(map, id, matches, 1, {});
  ASSERT_TRUE(better.has_value());
  EXPECT_LT((better->cam_from_world.Center() - scene.poses[2].Center()).norm(), 0.02);
  EXPECT_FALSE(FindBetterPose(map, id, {}, 1, {}).has_value()) << "nobody says otherwise";
  EXPECT_TRUE(IsDrawnElsewhere(map, id, matches));
  EXPECT_FALSE(IsDrawnElsewhere(map, id, {}));
}

}  // namespace
}  // namespace veduta
