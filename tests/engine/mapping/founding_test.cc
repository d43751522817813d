// SPDX-License-Identifier: Apache-2.0
// Goal: founding finds the scene from matches alone, and refuses views without parallax.
// Method: a synthetic scene; relative poses and tracks are compared with the truth.
#include "engine/mapping/founding.h"

#include <gtest/gtest.h>

#include "scene_checks.h"

namespace veduta {
namespace {

FoundingViews ViewsOf(const SyntheticScene& scene, uint32_t count) {
  FoundingViews views;
  for (uint32_t k = 0; k < count; ++k) views.images.push_back(Unplaced(scene.images[k]));
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = i + 1; j < count; ++j) views.pairs.push_back(scene.Pair(i, j));
  }
  return views;
}

TEST(Founding, FindsTheSceneFromMatches) {
  const SyntheticScene scene = MakeScene({});
  CityMap map;
  ASSERT_EQ(TryFounding(ViewsOf(scene, 5), ImageId(2), ReconstructionId(7), 1, {}, &map),
            FoundingOutcome::kFounded);
  EXPECT_EQ(map.images().size(), 3u);
  EXPECT_TRUE(map.HasImage(ImageId(2)));
  CheckTracks(map, scene);
  // Relative rotations do not depend on the frame.
  const auto first = map.images().begin(), last = std::prev(map.images().end());
  const Rigid3 found = last->second.cam_from_world * first->second.cam_from_world.Inverse();
  const Rigid3 truth =
      scene.poses[last->first.value - 1] * scene.poses[first->first.value - 1].Inverse();
  EXPECT_LT(RotationErrorDeg(found, truth), 0.3);
}

TEST(Founding, RefusesViewsThatMayStandElsewhere) {
  const SyntheticScene scene = MakeScene({});
  FoundingOptions options;
  options.deviation_share_max = 1e-6;
  CityMap map;
  EXPECT_EQ(TryFounding(ViewsOf(scene, 5), ImageId(2), ReconstructionId(7), 1, options, &map),
            FoundingOutcome::kUndetermined);
  EXPECT_TRUE(map.images().empty());
}

TEST(Founding, RefusesRotations) {
  SceneOptions options;
  options.rotation = true;
  const SyntheticScene scene = MakeScene(options);
  FoundingViews views = ViewsOf(scene, 4);
  for (PairRecord& pair :
       views.pairs) {  // what two-view estimation would name, and what it might miss
    pair.geometry = PairGeometry::kRotation;
    pair.b_from_a.translation = Eigen::Vector3d::UnitX();
  }
  CityMap map;
  EXPECT_EQ(TryFounding(views, ImageId(1), ReconstructionId(1), 1, {}, &map),
            FoundingOutcome::kNoPair);
  for (PairRecord& pair : views.pairs) pair.geometry = PairGeometry::kGeneral;
  EXPECT_NE(TryFounding(views, ImageId(1), ReconstructionId(1), 1, {}, &map),
            FoundingOutcome::kFounded);
  EXPECT_TRUE(map.images().empty());
}

}  // namespace
}  // namespace veduta
