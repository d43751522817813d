// SPDX-License-Identifier: Apache-2.0
// Goal: adjusting a whole reconstruction keeps its frame, and an image that was placed wrongly is
//   moved to where most points that others agree on are seen.
// Method: a synthetic scene in a database; one image's pose and points are shifted in memory.
#include "engine/ingest/reconstruction_adjustment.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(ReconstructionAdjustment, KeepsTheFrame) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4, 5});
  SceneWork work(&scene);
  ASSERT_OK(AdjustReconstruction(work.context, id));
  for (uint32_t k = 0; k < 6; ++k) {
    const Rigid3& pose = work.map.image(ImageId(k + 1)).cam_from_world;
    EXPECT_LT((pose.Center() - scene.scene().poses[k].Center()).norm(), 0.02);
    EXPECT_LT(RotationErrorDeg(pose, scene.scene().poses[k]), 0.1);
  }
  EXPECT_EQ(work.map.changes().poses.size(), 6u);
}

TEST(ReconstructionAdjustment, MovesAnImageThatStandsWrong) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4, 5});
  SceneWork work(&scene);
  std::vector<ImageId> images;
  ASSERT_OK(work.loader.LoadReconstruction(id, &images));
  const ImageId wrong = ImageId(3), self[] = {wrong};
  for (const PointId point : work.map.PointsSeenBy(self)) work.map.RemoveObservation(point, wrong);
  Rigid3 shifted = scene.scene().poses[2];
  shifted.translation.x() += 0.5;
  work.map.SetPose(wrong, shifted);
  ASSERT_OK(ReconsiderPoses(work.context, {images, images}));
  const Rigid3& found = work.map.image(wrong).cam_from_world;
  EXPECT_LT((found.Center() - scene.scene().poses[2].Center()).norm(), 0.02);
  EXPECT_GE(work.map.PointsSeenBy(self).size(), 100u);
  EXPECT_EQ(work.map.image(ImageId(1)).cam_from_world.translation,
            scene.scene().poses[0].translation)
      << "an image that stands right stays";
}

}  // namespace
}  // namespace veduta
