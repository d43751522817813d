// SPDX-License-Identifier: Apache-2.0
// Goal: only matches that agree with an image's pose are kept, tracks grow from them, and the pose
//   is refined by what they see.
// Method: a synthetic scene with one image not yet in the tracks; a part of its matches is wrong.
#include "engine/mapping/agreeing_growth.h"

#include <gtest/gtest.h>

#include "scene_checks.h"

namespace veduta {
namespace {

TEST(AgreeingGrowth, KeepsTrueMatchesAndRefines) {
  const SyntheticScene scene = MakeScene({});
  CityMap map;
  for (const uint32_t k : {0u, 1u, 2u}) map.PlaceImage(Unplaced(scene.images[k]));
  for (const auto& [from, to] : {std::pair(0u, 1u), std::pair(1u, 2u)}) {
    const PairMatches pair = MatchesFrom(scene.Pair(from, to), scene.images[to].id);
    GrowFromMatches(&map, scene.images[to].id, {&pair, 1}, {});
  }
  MapImage placed = Unplaced(scene.images[3]);
  placed.cam_from_world.translation.x() += 0.02;  // about 2 px in the photo
  map.PlaceImage(placed);
  std::vector<PairMatches> putative;
  for (const uint32_t j : {0u, 1u, 2u}) {
    putative.push_back(MatchesFrom(scene.Pair(j, 3), ImageId(4)));
    for (size_t i = 0; i < putative.back().matches.size(); i += 5)  // one in five is wrong
      putative.back().matches[i].b = (putative.back().matches[i].b + 60) % 100;
  }
  size_t right = 0, kept = 0, all = 0;
  for (const PairMatches& pair : KeepAgreeing(map, ImageId(4), putative, 3)) {
    for (const FeatureMatch& m : pair.matches)
      right += scene.seen[3][m.a] == scene.seen[pair.other.value - 1][m.b];
    kept += pair.matches.size();
  }
  for (const PairMatches& pair : putative) all += pair.matches.size();
  EXPECT_GE(right, all * 7 / 10);
  EXPECT_LE(kept - right, all / 50) << "few wrong ones lie by their lines by chance";
  GrowAndRefine(&map, ImageId(4), putative, {});
  const ImageId self[] = {ImageId(4)};
  EXPECT_GE(map.PointsSeenBy(self).size(), 100u);
  const Eigen::Vector3d center = map.image(ImageId(4)).cam_from_world.Center();
  EXPECT_LT((center - scene.poses[3].Center()).norm(), 0.013)
      << "points from three views are noisy";
}

}  // namespace
}  // namespace veduta
