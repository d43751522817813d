// SPDX-License-Identifier: Apache-2.0
// Goal: places that two reconstructions both hold as points are found through the view graph and
//   the photo's own matches, and only agreeing ones give the similarity between the two frames.
// Method: one synthetic scene stored as two reconstructions in different frames.
#include "engine/ingest/merge_candidates.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(MergeCandidates, FindsAndAlignsCommonPoints) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  scene.AddReconstruction({0, 1, 2});
  const ReconstructionId other = scene.AddReconstruction({3, 4, 5}, AnotherFrame());
  SceneWork work(&scene);
  const ImageId photo = ImageId(3), near[] = {ImageId(2), ImageId(1)};
  const ImageId all[] = {ImageId(1), ImageId(2), ImageId(3)};
  ASSERT_OK(work.loader.LoadNeighborhood(all));
  const auto common =
      FindCommonPoints(&work.loader, work.map, near, photo, scene.MatchesOf(2, {1, 3}));
  ASSERT_OK(common);
  ASSERT_EQ(common->size(), 1u);
  ASSERT_TRUE(common->contains(other));
  const std::vector<PointPair>& points = common->at(other);
  EXPECT_GT(points.size(), 100u);
  EXPECT_TRUE(std::is_sorted(points.begin(), points.end()));
  for (const PointPair& pair : points) {
    const Eigen::Vector3d carried = AnotherFrame() * work.map.point(pair.into).position;
    EXPECT_LT((carried - work.map.point(pair.from).position).norm(), 1e-9);
  }

  std::vector<PointPair> disturbed = points;
  for (size_t i = 0; i + 3 < disturbed.size(); i += 3)
    std::swap(disturbed[i].from, disturbed[i + 3].from);
  const auto alignment = AlignPoints(work.map, disturbed, 4, 20, 1);
  ASSERT_TRUE(alignment.has_value());
  EXPECT_NEAR(alignment->into_from.scale, 2, 1e-6);
  EXPECT_GE(alignment->agreeing.size(), points.size() / 2);
  const auto too_many = static_cast<uint32_t>(points.size());
  EXPECT_FALSE(AlignPoints(work.map, disturbed, 4, too_many, 1).has_value());
}

// In a large city the points of a nearby image are loaded for another image's sake, and the images
// that see them are not.
TEST(MergeCandidates, LoadsTheImagesThatSeeACommonPoint) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  scene.AddReconstruction({0, 1, 2});
  const ReconstructionId other = scene.AddReconstruction({3, 4, 5}, AnotherFrame());
  SceneWork work(&scene);
  const ImageId photo[] = {ImageId(3)};
  ASSERT_OK(work.loader.LoadStructure(photo));
  ASSERT_FALSE(work.map.HasImage(ImageId(1)));
  const auto common = FindCommonPoints(&work.loader, work.map, photo, photo[0], {});
  ASSERT_OK(common);
  ASSERT_TRUE(common->contains(other));
  const auto alignment = AlignPoints(work.map, common->at(other), 4, 20, 1);
  ASSERT_TRUE(alignment.has_value());
  EXPECT_NEAR(alignment->into_from.scale, 2, 1e-6);
}

TEST(MergeCandidates, OneReconstructionAloneHasNone) {
  SceneDatabase scene;
  scene.AddImages(0, 5);
  scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  const ImageId all[] = {ImageId(1), ImageId(2), ImageId(3)};
  ASSERT_OK(work.loader.LoadNeighborhood(all));
  const auto common =
      FindCommonPoints(&work.loader, work.map, all, ImageId(3), scene.MatchesOf(2, {0, 1, 3, 4}));
  ASSERT_OK(common);
  EXPECT_TRUE(common->empty());
}

}  // namespace
}  // namespace veduta
