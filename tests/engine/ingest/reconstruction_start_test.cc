// SPDX-License-Identifier: Apache-2.0
// Goal: a photo founds a reconstruction with two of its neighbours that have no pose, which then
//   sees what the scene holds; where it cannot, the reason says why and the map stays empty.
// Method: a synthetic scene in a database without any pose.
#include "engine/ingest/reconstruction_start.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(ReconstructionStart, FoundsWithTheBestTriple) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  SceneWork work(&scene);
  const auto start = StartReconstruction(work.context, *scene.Photo(4),
                                         scene.MatchesOf(4, {0, 1, 2, 3}), ReconstructionId(7), 1);
  ASSERT_OK(start);
  ASSERT_EQ(start->outcome, FoundingOutcome::kFounded);
  EXPECT_EQ(start->view_count, 5u);
  ASSERT_EQ(start->placed.size(), 3u);
  EXPECT_EQ(start->placed.front(), ImageId(5));
  EXPECT_GE(start->point_count, 20u);
  EXPECT_EQ(work.map.images().size(), 3u);
  for (const ImageId id : start->placed) {
    EXPECT_EQ(work.map.image(id).reconstruction, ReconstructionId(7));
    EXPECT_LT(RelativeRotationErrorDeg(work.map, scene.scene(), 4, id.value - 1), 0.3);
  }
}

TEST(ReconstructionStart, SaysWhyNot) {
  SceneDatabase scene;
  scene.AddImages(0, 1);
  SceneWork work(&scene);
  const auto start = StartReconstruction(work.context, *scene.Photo(1), scene.MatchesOf(1, {0}),
                                         ReconstructionId(1), 1);
  ASSERT_OK(start);
  EXPECT_EQ(start->outcome, FoundingOutcome::kNoPair);
  EXPECT_EQ(start->view_count, 2u);
  EXPECT_TRUE(work.map.images().empty());
  EXPECT_EQ(NoStartDetail(*start, 1),
            "1 verified neighbours, none placed, and three views are needed to start");
  ReconstructionStart none{FoundingOutcome::kNoThirdView, 4, {}, 0};
  EXPECT_NE(NoStartDetail(none, 3).find("third view"), std::string::npos);
}

}  // namespace
}  // namespace veduta
