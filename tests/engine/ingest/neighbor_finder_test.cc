// SPDX-License-Identifier: Apache-2.0
// Goal: the neighbours of verified and of ranked images are tried too, within their limits; the
//   result is in ascending order and does not depend on the threads; two searches are joined by the
//   better pair.
// Method: a synthetic scene in a database, with only one image given as a candidate.
#include "engine/ingest/neighbor_finder.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

NeighborSearch Find(SceneDatabase* scene, const NeighborOptions& options) {
  SceneWork work(scene);
  const RankedImage candidates[] = {{ImageId(3), 1.0}, {ImageId(3), 0.5}};
  auto found = FindNeighbors(*scene->Photo(5), candidates, 1, &work.loader, work.map, scene->pool(),
                             options);
  EXPECT_OK(found);
  return found.ok() ? std::move(*found) : NeighborSearch();
}

TEST(NeighborFinder, ReachesTheNeighboursOfACandidate) {
  SceneDatabase scene({}, 0), threaded({}, 3);
  scene.AddImages(0, 5);
  threaded.AddImages(0, 5);
  const NeighborSearch found = Find(&scene, {}), same = Find(&threaded, {});
  EXPECT_EQ(found.tried_count, 5u) << "one candidate, named twice, and its four neighbours";
  ASSERT_EQ(found.pairs.size(), 5u);
  ASSERT_EQ(same.pairs.size(), 5u);
  for (uint32_t i = 0; i < 5; ++i) {
    EXPECT_EQ(found.pairs[i].a, ImageId(i + 1));
    EXPECT_EQ(found.pairs[i].b, ImageId(6));
    EXPECT_EQ(found.pairs[i].matches, same.pairs[i].matches);
    EXPECT_EQ(found.pairs[i].b_from_a.translation, same.pairs[i].b_from_a.translation);
  }
  EXPECT_EQ(found.promising.size(), 5u);
}

TEST(NeighborFinder, KeepsToItsLimits) {
  SceneDatabase scene;
  scene.AddImages(0, 5);
  NeighborOptions options;
  options.extended_count_max = 0;
  EXPECT_EQ(Find(&scene, options).tried_count, 1u);
  options.extended_count_max = options.extended_per_image_max = 1;
  EXPECT_EQ(Find(&scene, options).tried_count, 2u);
}

TEST(NeighborFinder, SaysWhatFailed) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  const SceneDatabase other({.seed = 9});
  SceneWork work(&scene);
  const RankedImage candidates[] = {{ImageId(1), 1.0}};
  const auto stranger =
      ImageFeatures::Make(ImageId(9), scene.Model(), other.Photo(0)->features, 1500);
  const auto found =
      FindNeighbors(**stranger, candidates, 1, &work.loader, work.map, scene.pool(), {});
  ASSERT_OK(found);
  EXPECT_TRUE(found->pairs.empty());
  EXPECT_EQ(found->tried_count, 3u);
  EXPECT_TRUE(found->best_failed.valid());
  EXPECT_EQ(found->promising.size(), 3u);
}

TEST(NeighborFinder, JoinedSearchesKeepTheBetterPair) {
  const SceneDatabase scene;
  NeighborSearch first, second;
  first.tried_count = 4;
  first.pairs = {scene.scene().Pair(0, 5), scene.scene().Pair(1, 5)};
  second.pairs = {scene.scene().Pair(0, 5), scene.scene().Pair(2, 5)};
  const size_t all = first.pairs[0].matches.size();
  first.pairs[0].matches.resize(25);
  second.promising = {{ImageId(3), 0}};
  JoinSearches(ImageId(6), std::move(second), &first);
  ASSERT_EQ(first.pairs.size(), 3u);
  EXPECT_EQ(first.pairs[0].matches.size(), all);
  EXPECT_EQ(first.pairs[1].a, ImageId(2));
  EXPECT_EQ(first.pairs[2].a, ImageId(3));
  EXPECT_EQ(first.tried_count, 4u);
  EXPECT_EQ(first.promising.size(), 1u);
}

}  // namespace
}  // namespace veduta
