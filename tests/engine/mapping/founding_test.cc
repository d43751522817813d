// SPDX-License-Identifier: Apache-2.0
// Goal: founding finds the scene from matches alone, also where they lie on a plane, and refuses
//   views without parallax.
// Method: a synthetic scene; relative poses and tracks are compared with the truth.
#include "engine/mapping/founding.h"

#include <gtest/gtest.h>

#include "engine/mapping/plane_twin.h"
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

// Relative rotations do not depend on the frame.
void CheckRotations(const CityMap& map, const SyntheticScene& scene) {
  const auto first = map.images().begin();
  for (const auto& [id, image] : map.images()) {
    const Rigid3 found = image.cam_from_world * first->second.cam_from_world.Inverse();
    const Rigid3 truth = scene.poses[id.value - 1] * scene.poses[first->first.value - 1].Inverse();
    EXPECT_LT(RotationErrorDeg(found, truth), 0.3);
  }
}

TEST(Founding, FindsTheSceneFromMatches) {
  const SyntheticScene scene = MakeScene({});
  CityMap map;
  ASSERT_EQ(TryFounding(ViewsOf(scene, 5), ImageId(2), ReconstructionId(7), 1, {}, &map),
            FoundingOutcome::kFounded);
  EXPECT_EQ(map.images().size(), 3u);
  EXPECT_TRUE(map.HasImage(ImageId(2)));
  CheckTracks(map, scene);
  CheckRotations(map, scene);
}

// Pairs of a plane, with the other one of their two relative poses.
FoundingViews TwinViewsOf(const SyntheticScene& scene, uint32_t count) {
  FoundingViews views = ViewsOf(scene, count);
  for (PairRecord& pair : views.pairs) {
    const Rigid3& a = scene.poses[pair.a.value - 1];
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3d& point : scene.points) points.push_back(a * point);
    const Rigid3 b_from_a = scene.poses[pair.b.value - 1] * a.Inverse();
    const auto plane = FitPlane(points);
    const auto twin =
        plane ? PlaneTwin(b_from_a, *plane, a * Eigen::Vector3d(0, 0, 0)) : std::nullopt;
    if (twin) pair.b_from_a = *twin;
  }
  return views;
}

TEST(Founding, FindsWhichPoseOfAPlaneIsRight) {
  SceneOptions options;
  options.planar = true;
  options.forward = 0.5;
  const SyntheticScene scene = MakeScene(options);
  CityMap map;
  ASSERT_EQ(TryFounding(TwinViewsOf(scene, 5), ImageId(2), ReconstructionId(7), 1, {}, &map),
            FoundingOutcome::kFounded);
  CheckTracks(map, scene);
  CheckRotations(map, scene);
}

// Whoever walks straight on before a plane sees what the other pose would show.
TEST(Founding, RefusesAPlaneWhereNeitherPoseIsClearlyBetter) {
  SceneOptions options;
  options.planar = true;
  options.forward = 0.6;
  options.arc_deg = 10;
  const FoundingViews views = ViewsOf(MakeScene(options), 5);
  FoundingOptions founding;
  founding.deviation_share_max = founding.network_deviation_share_max = 1;
  CityMap map;
  EXPECT_EQ(TryFounding(views, ImageId(2), ReconstructionId(7), 1, founding, &map),
            FoundingOutcome::kUndetermined);
  EXPECT_TRUE(map.images().empty());
  founding.twin_score_share_max = 1e9;
  EXPECT_EQ(TryFounding(views, ImageId(2), ReconstructionId(7), 1, founding, &map),
            FoundingOutcome::kFounded);
}

TEST(Founding, RefusesViewsThatMayStandElsewhere) {
  const SyntheticScene scene = MakeScene({});
  FoundingOptions one, all;
  one.deviation_share_max = 1e-6;
  all.network_deviation_share_max = 1e-6;
  for (const FoundingOptions& options : {one, all}) {
    CityMap map;
    EXPECT_EQ(TryFounding(ViewsOf(scene, 5), ImageId(2), ReconstructionId(7), 1, options, &map),
              FoundingOutcome::kUndetermined);
    EXPECT_TRUE(map.images().empty());
  }
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

TEST(Founding, NothingIsFoundedByViewsOfARepeatedFront) {
  SceneOptions scene_options;
  scene_options.repeats = 6;
  const FoundingViews views = ViewsOf(MakeScene(scene_options), 5);
  CityMap map;
  EXPECT_EQ(TryFounding(views, ImageId(2), ReconstructionId(7), 1, {}, &map),
            FoundingOutcome::kRepeated);
  EXPECT_TRUE(map.images().empty());
  FoundingOptions options;
  options.repeated_share_max = 1;
  EXPECT_EQ(TryFounding(views, ImageId(2), ReconstructionId(7), 1, options, &map),
            FoundingOutcome::kFounded);
}

}  // namespace
}  // namespace veduta
