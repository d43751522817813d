// SPDX-License-Identifier: Apache-2.0
// Goal: poses are sought by placed neighbours alone; only one that is good enough is chosen; a
//   photo is entered into the map with its tracks, and each reason to refuse it is said.
// Method: a synthetic scene in a database, of which some cameras are placed; limits that nothing
//   can keep.
#include "engine/ingest/believed_pose.h"

#include <gtest/gtest.h>

#include "engine/ingest/forbidding.h"
#include "engine/ingest/local_unplacing.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(BelievedPose, SeeksByPlacedNeighboursAndEntersThePhoto) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  const auto photo = scene.Photo(4);
  const auto sought = SeekPoses(work.context, *photo, scene.MatchesOf(4, {0, 1, 2, 3}), 1);
  ASSERT_OK(sought);
  EXPECT_EQ(sought->putative.size(), 3u) << "the fourth has no pose";
  ASSERT_TRUE(sought->has_sure_pose());
  const auto pose = ChoosePose(work.context, *photo, sought->search.found);
  ASSERT_OK(pose);
  ASSERT_EQ(*pose, &sought->search.found.front());
  const Placement placed = PlacedAt(*photo, **pose);
  EXPECT_EQ(placed.verdict, Verdict::kPlaced);
  EXPECT_EQ(placed.reconstruction, id);
  EXPECT_EQ(placed.detail, "agrees with " + std::to_string(placed.inlier_count) + " of " +
                               std::to_string((*pose)->point_count) + " points");

  const auto refused = EnterPose(work.context, *photo, **pose, sought->putative);
  ASSERT_OK(refused);
  EXPECT_FALSE(*refused);
  EXPECT_LT(RelativeRotationErrorDeg(work.map, scene.scene(), 0, 4), 0.1);
  const uint32_t seen = CountObservations(work.map.image(photo->id));
  EXPECT_GE(seen, 100u);
  EXPECT_FALSE(AskHowMuchItSees(work.context, photo->id));
  const auto missing = AskWhatIsMissing(work.context, photo->id);
  ASSERT_OK(missing);
  EXPECT_FALSE(*missing);

  work.options.observations_min = seen + 1;
  const auto few = AskHowMuchItSees(work.context, photo->id);
  ASSERT_TRUE(few);
  EXPECT_EQ(few->reason, Reason::kResectionFailed);
  EXPECT_EQ(few->detail, "only " + std::to_string(seen) + " points are left after adjustment; " +
                             std::to_string(seen + 1) + " are needed");
}

TEST(BelievedPose, ChoosesNoneWhereNoneIsGoodEnough) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  const auto photo = scene.Photo(3);
  const std::vector<PairMatches> pairs = scene.MatchesOf(3, {0, 1, 2});
  auto sought = SeekPoses(work.context, *photo, pairs, 1);
  ASSERT_OK(sought);
  ASSERT_EQ(sought->search.found.size(), 1u);
  sought->search.found.front().is_weak = true;
  EXPECT_FALSE(sought->has_sure_pose());
  work.options.weak_inlier_count_min = 100'000;
  const auto none = ChoosePose(work.context, *photo, sought->search.found);
  ASSERT_OK(none);
  EXPECT_EQ(*none, nullptr);
  const auto nothing = ChoosePose(work.context, *photo, {});
  ASSERT_OK(nothing);
  EXPECT_EQ(*nothing, nullptr);
}

TEST(BelievedPose, IsRefusedWhereItMayStandElsewhere) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  work.options.deviation_share_max = 1e-6;
  const auto photo = scene.Photo(3);
  const auto sought = SeekPoses(work.context, *photo, scene.MatchesOf(3, {0, 1, 2}), 1);
  ASSERT_OK(sought);
  const auto refused =
      EnterPose(work.context, *photo, sought->search.found.front(), sought->putative);
  ASSERT_OK(refused);
  ASSERT_TRUE(*refused);
  EXPECT_EQ((*refused)->verdict, Verdict::kPostponed);
  EXPECT_EQ((*refused)->reason, Reason::kUndetermined);
  EXPECT_TRUE(work.map.HasImage(photo->id));
}

TEST(BelievedPose, WhoMustNotHaveAPoseLeadsNobody) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  Retrieval retrieval{RetrievalOptions()};
  const IngestOptions options;
  CityMap map;
  const IngestParts parts{scene.database(), &retrieval, scene.features(),
                          scene.pool(),     options,    &map};
  ASSERT_OK(ForbidPose(parts, ImageId(2), "anna", "it was moved", BeginWrite(scene.database())));
  const std::vector<PairMatches> pairs = scene.MatchesOf(4, {0, 1, 2});
  const auto allowed = WithoutForbidden(*scene.Snap(), pairs);
  ASSERT_OK(allowed);
  ASSERT_EQ(allowed->size(), 2u);
  EXPECT_EQ(allowed->front().other, ImageId(1));
  EXPECT_EQ(allowed->back().other, ImageId(3));
}

}  // namespace
}  // namespace veduta
