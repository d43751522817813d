// SPDX-License-Identifier: Apache-2.0
// Goal: adjusting a whole reconstruction keeps its frame, and an image that was placed wrongly is
//   moved to where most points that others agree on are seen. No image keeps a pose by fewer points
//   than a pose needs, whatever took the others: filters, cuts or lost poses. Images that stand
//   wrong as one body are carried back.
// Method: a synthetic scene in a database; poses and points of one image or of a side are shifted
//   in memory, or taken away, where tracks cannot grow.
#include "engine/ingest/reconstruction_adjustment.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/torn_scene.h"

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

// How many points an image sees together with one of these.
uint32_t CountShared(const CityMap& map, ImageId image, const std::vector<ImageId>& others) {
  uint32_t shared = 0;
  for (const PointId point : map.PointsSeenBy(std::vector{image})) {
    shared += std::ranges::any_of(map.point(point).track, [&](const TrackElement& element) {
      return std::ranges::find(others, element.image) != others.end();
    });
  }
  return shared;
}

TEST(ReconstructionAdjustment, CarriesImagesThatStandWrongAsOneBody) {
  SceneOptions options = kTwoSides;
  options.seam_point_count = 60;
  SceneDatabase scene(options);
  const ReconstructionId id = AddTwoSides(&scene);
  SceneWork work(&scene);
  std::vector<ImageId> images;
  ASSERT_OK(work.loader.LoadReconstruction(id, &images));
  const std::vector<ImageId> body = SideImages(1);
  work.map.CutOff({body.begin(), body.end()});
  for (const ImageId image : body) {
    work.map.MoveImage(image, id, {1, Eigen::Quaterniond::Identity(), {0.2, 0, 0}});
    work.map.MoveBlock(image, id, {1, Eigen::Quaterniond::Identity(), {0.2, 0, 0}});
  }
  ASSERT_EQ(CountShared(work.map, body.front(), SideImages(0)), 0u);
  const auto healing = AdjustReconstruction(work.context, id);
  ASSERT_OK(healing);
  EXPECT_TRUE(healing->empty());
  EXPECT_GE(CountShared(work.map, body.front(), SideImages(0)), 30u);
  for (uint32_t k = 0; k < 8; ++k) {
    const Rigid3& pose = work.map.image(ImageId(k + 1)).cam_from_world;
    const Rigid3 relative = pose * work.map.image(ImageId(1)).cam_from_world.Inverse();
    const Rigid3 truth = scene.scene().poses[k] * scene.scene().poses[0].Inverse();
    EXPECT_LT((relative.Center() - truth.Center()).norm(), 0.05) << k;
  }
}

// Leaves the image so many of the points that it sees together with one of these.
void KeepShared(CityMap* map, ImageId image, const std::vector<ImageId>& others, uint32_t count) {
  uint32_t kept = 0;
  for (const PointId point : map->PointsSeenBy(std::vector{image})) {
    const bool is_shared =
        std::ranges::any_of(map->point(point).track, [&](const TrackElement& element) {
          return std::ranges::find(others, element.image) != others.end();
        });
    if (is_shared && ++kept > count) map->RemoveObservation(point, image);
  }
}

// No feature is good enough for a track to grow by it.
void StopGrowth(MapperOptions* options) {
  options->growth.error_px_max = options->growth.search_radius_px = -1;
}

TEST(ReconstructionAdjustment, WhatFewPointsHoldAfterACutLosesItsPose) {
  SceneDatabase scene(kTwoSides);
  const ReconstructionId id = AddTwoSides(&scene);
  ContradictSeam(&scene);
  SceneWork work(&scene);
  StopGrowth(&work.options);
  std::vector<ImageId> images;
  ASSERT_OK(work.loader.LoadReconstruction(id, &images));
  // Image 5 shares enough with its side to belong to it. But most images that see these points are
  // of the other side, so the cut leaves them there.
  const ImageId lonely = SideImages(1).front();
  KeepShared(&work.map, lonely, {ImageId(6), ImageId(7), ImageId(8)}, 15);
  ASSERT_GE(CountShared(work.map, lonely, SideImages(0)), 20u);
  const auto healing = AdjustReconstruction(work.context, id);
  ASSERT_OK(healing);
  ASSERT_EQ(healing->parts.size(), 1u);
  EXPECT_EQ(healing->parts.front().size(), 3u);
  ASSERT_EQ(healing->unplaced.size(), 1u);
  EXPECT_EQ(healing->unplaced.front().image, lonely);
  EXPECT_EQ(healing->unplaced.front().why, "only 0 points hold it; 20 are needed");
  EXPECT_FALSE(work.map.HasImage(lonely));
}

TEST(ReconstructionAdjustment, WithoutTheOneThatFewPointsHoldOthersMayFallToo) {
  SceneDatabase scene;
  scene.AddImages(0, 5);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4});
  SceneWork work(&scene);
  StopGrowth(&work.options);
  std::vector<ImageId> images;
  ASSERT_OK(work.loader.LoadReconstruction(id, &images));
  // Image 4 sees little but what image 5 sees, which sees too little.
  KeepShared(&work.map, ImageId(5), {ImageId(1), ImageId(2), ImageId(3)}, 0);
  KeepShared(&work.map, ImageId(4), {ImageId(1), ImageId(2), ImageId(3)}, 15);
  KeepShared(&work.map, ImageId(5), {ImageId(4)}, 19);
  const auto healing = AdjustReconstruction(work.context, id);
  ASSERT_OK(healing);
  ASSERT_EQ(healing->unplaced.size(), 2u);
  EXPECT_EQ(healing->unplaced[0].image, ImageId(5));
  EXPECT_EQ(healing->unplaced[1].image, ImageId(4));
  EXPECT_TRUE(healing->parts.empty());
  for (const uint32_t left : {1u, 2u, 3u}) EXPECT_TRUE(work.map.HasImage(ImageId(left)));
}

TEST(ReconstructionAdjustment, TwoAreNoReconstruction) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  StopGrowth(&work.options);
  std::vector<ImageId> images;
  ASSERT_OK(work.loader.LoadReconstruction(id, &images));
  KeepShared(&work.map, ImageId(3), {ImageId(1), ImageId(2)}, 19);
  const auto healing = AdjustReconstruction(work.context, id);
  ASSERT_OK(healing);
  EXPECT_EQ(healing->unplaced.size(), 3u);
  EXPECT_TRUE(work.map.images().empty());
}

}  // namespace
}  // namespace veduta
