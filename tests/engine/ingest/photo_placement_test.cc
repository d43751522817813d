// SPDX-License-Identifier: Apache-2.0
// Goal: a photo is placed, merges reconstructions, founds one or is postponed, as the paper's four
//   cases have it, and its answer names what it did.
// Method: a synthetic scene in a database, of which different parts are placed already.
#include "engine/ingest/photo_placement.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

Placement Place(SceneDatabase* scene, SceneWork* work, uint32_t camera,
                const std::vector<uint32_t>& neighbors, ReconstructionId new_reconstruction) {
  auto placed = PlacePhoto(work->context, *scene->Photo(camera),
                           scene->MatchesOf(camera, neighbors), new_reconstruction, 1);
  EXPECT_OK(placed);
  return placed.ok() ? *placed : Placement();
}

TEST(PhotoPlacement, PlacesInOneReconstruction) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  const Placement placed = Place(&scene, &work, 4, {0, 1, 2, 3}, ReconstructionId(2));
  EXPECT_EQ(placed.verdict, Verdict::kPlaced) << placed.detail;
  EXPECT_EQ(placed.reason, Reason::kRegistered);
  EXPECT_EQ(placed.reconstruction, id);
  EXPECT_EQ(placed.placed, std::vector{ImageId(5)});
  EXPECT_FALSE(placed.founded.valid());
  EXPECT_GE(placed.inlier_count, 100u);
  EXPECT_LT(RelativeRotationErrorDeg(work.map, scene.scene(), 0, 4), 0.1);
  EXPECT_TRUE(work.map.changes().poses.contains(ImageId(5)));
}

TEST(PhotoPlacement, MergesWhatItJoins) {
  SceneDatabase scene({.camera_count = 8});
  scene.AddImages(0, 7);
  const ReconstructionId first = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId second = scene.AddReconstruction({5, 6}, AnotherFrame());
  SceneWork work(&scene);
  const Placement placed = Place(&scene, &work, 4, {0, 1, 2, 3, 5, 6}, ReconstructionId(3));
  EXPECT_EQ(placed.verdict, Verdict::kMerged) << placed.detail;
  EXPECT_EQ(placed.reason, Reason::kJoinedReconstructions);
  EXPECT_EQ(placed.reconstruction, first);
  ASSERT_EQ(placed.merges.size(), 1u);
  EXPECT_EQ(placed.merges[0].from, second);
  EXPECT_NE(placed.detail.find("reconstructions 2 and 1 merged by"), std::string::npos)
      << placed.detail;
  EXPECT_LT(RelativeRotationErrorDeg(work.map, scene.scene(), 0, 6), 0.2);
}

// At a seam that is known and so large that no photo judges it.
TEST(PhotoPlacement, SaysWhoMayStandOnEitherSideOfASeam) {
  for (const RefusalReason reason : {RefusalReason::kFewPairs, RefusalReason::kContradicted}) {
    SceneDatabase scene({.camera_count = 8, .point_count = 2000});
    scene.AddImages(0, 7);
    const ReconstructionId first = scene.AddReconstruction({0, 1, 2, 3});
    const ReconstructionId second = scene.AddReconstruction({4, 5, 6}, AnotherFrame());
    HypothesisRecord hypothesis;
    hypothesis.a = first;
    hypothesis.b = second;
    hypothesis.reason = reason;
    hypothesis.judged_cells = 1000;
    hypothesis.images = {ImageId(4), ImageId(5)};
    const auto transaction = scene.database()->BeginTransaction();
    transaction->PutHypothesis(hypothesis);
    ASSERT_OK(transaction->Commit());
    SceneWork work(&scene);
    const Placement placed = Place(&scene, &work, 7, {0, 1, 4, 5}, ReconstructionId(3));
    ASSERT_EQ(placed.verdict, Verdict::kPlaced) << placed.detail;
    ASSERT_EQ(placed.known.size(), 1u);
    EXPECT_EQ(placed.known[0].reason, reason);
    const std::vector<ImageId> all = {ImageId(1), ImageId(2), ImageId(5), ImageId(6), ImageId(8)};
    EXPECT_EQ(placed.known[0].unsure,
              reason == RefusalReason::kContradicted ? all : std::vector<ImageId>());
  }
}

TEST(PhotoPlacement, FoundsOnlyWhereItMay) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  SceneWork work(&scene);
  const Placement founded = Place(&scene, &work, 3, {0, 1, 2}, ReconstructionId(1));
  EXPECT_EQ(founded.verdict, Verdict::kFounded) << founded.detail;
  EXPECT_EQ(founded.founded, ReconstructionId(1));
  EXPECT_EQ(founded.placed.size(), 3u);
  EXPECT_EQ(founded.placed.front(), ImageId(4));
  SceneWork other(&scene);
  const Placement refused = Place(&scene, &other, 3, {0, 1, 2}, ReconstructionId());
  EXPECT_EQ(refused.verdict, Verdict::kPostponed);
  EXPECT_TRUE(other.map.images().empty());
}

TEST(PhotoPlacement, IsPostponedWhereItMayStandElsewhere) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  work.options.deviation_share_max = 1e-6;
  const Placement placed = Place(&scene, &work, 3, {0, 1, 2}, ReconstructionId(2));
  EXPECT_EQ(placed.verdict, Verdict::kPostponed);
  EXPECT_EQ(placed.reason, Reason::kUndetermined);
  EXPECT_NE(placed.detail.find("by what it sees of reconstruction 1, errors of 1 mrad move it by"),
            std::string::npos)
      << placed.detail;
  EXPECT_TRUE(work.map.changes().poses.empty());
}

TEST(PhotoPlacement, PostponesWithItsReason) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  SceneWork work(&scene);
  const Placement lonely = Place(&scene, &work, 3, {1}, ReconstructionId(1));
  EXPECT_EQ(lonely.verdict, Verdict::kPostponed);
  EXPECT_EQ(lonely.reason, Reason::kNoGoodTriple);
  EXPECT_TRUE(lonely.placed.empty());

  scene.AddReconstruction({0, 1, 2});
  SceneWork strict(&scene);
  strict.options.observations_min = 100'000;
  const Placement few = Place(&scene, &strict, 3, {0, 1, 2}, ReconstructionId(2));
  EXPECT_EQ(few.verdict, Verdict::kPostponed);
  EXPECT_EQ(few.reason, Reason::kResectionFailed);
  EXPECT_NE(few.detail.find("are left after adjustment"), std::string::npos) << few.detail;
  EXPECT_TRUE(strict.map.images().empty()) << "what was changed is dropped";
}

}  // namespace
}  // namespace veduta
