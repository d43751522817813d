// SPDX-License-Identifier: Apache-2.0
// Goal: growing finds observations that were missing, and adjusting moves a wrong pose to the truth
//   while the rest is held.
// Method: a synthetic scene in a database, disturbed in memory.
#include "engine/ingest/surroundings.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

struct Loaded {
  Loaded() : work(&Stored(&scene)) {
    EXPECT_OK(work.loader.LoadReconstruction(ReconstructionId(1), &members));
  }
  static SceneDatabase& Stored(SceneDatabase* scene) {
    scene->AddImages(0, 6);
    scene->AddReconstruction({0, 1, 2, 3, 4, 5});
    return *scene;
  }
  SceneDatabase scene;
  SceneWork work;
  std::vector<ImageId> members;
};

TEST(Surroundings, GrowsWhatIsMissing) {
  Loaded loaded;
  CityMap& map = loaded.work.map;
  const ImageId self[] = {ImageId(3)};
  const std::vector<PointId> points = map.PointsSeenBy(self);
  size_t removed = 0;
  for (const PointId id : points) {
    if (map.point(id).track.size() > 3 && removed < 40)
      map.RemoveObservation(id, ImageId(3)), ++removed;
  }
  ASSERT_OK(GrowAround(loaded.work.context, ImageId(3)));
  EXPECT_GE(map.PointsSeenBy(self).size(), points.size() - 4);
}

TEST(Surroundings, AdjustsAPoseAndHoldsTheRest) {
  Loaded loaded;
  CityMap& map = loaded.work.map;
  Rigid3 wrong = map.image(ImageId(3)).cam_from_world;
  wrong.translation.x() += 0.02;
  map.SetPose(ImageId(3), wrong);
  loaded.work.options.local_bundle.iterations_max = 20;
  loaded.work.options.filter.observation_error_px_max = 50;
  loaded.work.options.filter.point_error_px_max = 50;
  ASSERT_OK(AdjustAround(loaded.work.context, ImageId(3), 1));
  const Rigid3& truth = loaded.scene.scene().poses[2];
  EXPECT_LT((map.image(ImageId(3)).cam_from_world.Center() - truth.Center()).norm(), 0.01);
  EXPECT_EQ(map.image(ImageId(1)).cam_from_world.translation,
            loaded.scene.scene().poses[0].translation);
}

}  // namespace
}  // namespace veduta
