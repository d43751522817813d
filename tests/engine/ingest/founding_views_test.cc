// SPDX-License-Identifier: Apache-2.0
// Goal: the views that could found a reconstruction are the photo and its neighbours without a
//   pose, those with most matches first, with all pairs among them.
// Method: a synthetic scene in a database, two of its images placed.
#include "engine/ingest/founding_views.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(FoundingViews, AreUnplacedNeighboursWithTheirPairs) {
  SceneDatabase scene;
  scene.AddImages(0, 5);
  scene.AddReconstruction({0, 1});
  SceneWork work(&scene);
  const auto pairs = scene.MatchesOf(5, {0, 1, 2, 3, 4});
  const ImageId placed[] = {ImageId(1), ImageId(2)};
  ASSERT_OK(work.loader.LoadImages(placed));
  const auto views = GatherFoundingViews(&work.loader, work.map, *scene.Photo(5), pairs, 12);
  ASSERT_OK(views);
  ASSERT_EQ(views->images.size(), 4u);
  for (uint32_t i = 0; i < 4; ++i) EXPECT_EQ(views->images[i].id, ImageId(i + 3));
  EXPECT_EQ(views->pairs.size(), 6u) << "each of the four with each other";
  const auto few = GatherFoundingViews(&work.loader, work.map, *scene.Photo(5), pairs, 3);
  ASSERT_OK(few);
  EXPECT_EQ(few->images.size(), 3u);
}

}  // namespace
}  // namespace veduta
