// SPDX-License-Identifier: Apache-2.0
// Goal: a photo's pose is found in each reconstruction that its neighbours belong to, and every way
//   of failing says so with its reason: too few points, no pose, contradiction, a weak pose.
// Method: a synthetic scene; matches are shifted or thinned where a search is to fail.
#include "engine/ingest/pose_search.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

class PoseSearchTest : public testing::Test {
 protected:
  PoseSearch Search(const std::vector<PairMatches>& verified,
                    const std::vector<PairMatches>& putative, const MapperOptions& options = {}) {
    return FindPoses(map_, *scene_.Photo(3), verified, putative, 1, options);
  }
  std::vector<PairMatches> Thinned(size_t count) {
    std::vector<PairMatches> matches = scene_.MatchesOf(3, {0, 1, 2});
    for (PairMatches& pair : matches) pair.matches.resize(count);
    return matches;
  }

  SceneDatabase scene_;
  CityMap map_ = scene_.MapOf({0, 1, 2}, ReconstructionId(1));
};

TEST_F(PoseSearchTest, FindsTheTruePose) {
  const auto matches = scene_.MatchesOf(3, {0, 1, 2});
  const PoseSearch search = Search(matches, matches);
  ASSERT_EQ(search.found.size(), 1u);
  const PoseCandidate& pose = search.found.front();
  EXPECT_EQ(pose.outcome, PoseOutcome::kFound);
  EXPECT_EQ(pose.reconstruction, ReconstructionId(1));
  EXPECT_FALSE(pose.is_weak);
  EXPECT_EQ(pose.agreement.agreeing_images, 3u);
  EXPECT_LT(RotationErrorDeg(pose.resection.cam_from_world, scene_.scene().poses[3]), 0.1);
  EXPECT_TRUE(IsGoodEnough(pose, {}));
}

// How far off the pose of photo 3 is whose points all lie in the middle of the picture.
double ErrorByTheMiddle(const SceneOptions& scene_options, double deviation_share_max) {
  const SceneDatabase scene(scene_options);
  const CityMap map = scene.MapOf({0, 1, 2}, ReconstructionId(1));
  const std::shared_ptr<const ImageFeatures> photo = scene.Photo(3);
  const auto verified = scene.MatchesOf(3, {0, 1, 2});
  auto putative = verified;
  for (PairMatches& pair : putative) {
    std::erase_if(pair.matches, [&](const FeatureMatch& match) {
      const Keypoint& keypoint = photo->features->keypoints[match.a];
      return std::hypot(keypoint.x_px - 500, keypoint.y_px - 400) > 80;
    });
  }
  MapperOptions options;
  options.deviation_share_max = deviation_share_max;
  const PoseSearch search = FindPoses(map, *photo, verified, putative, 1, options);
  EXPECT_EQ(search.found.size(), 1u) << search.detail;
  if (search.found.empty()) return 0;
  const Rigid3& pose = search.found.front().resection.cam_from_world;
  return (pose.Center() - scene.scene().poses[3].Center()).norm();
}

TEST(PoseSearch, VerifiedNeighboursAreAskedWherePointsSayTooLittle) {
  double asked = 0, unasked = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const SceneOptions scene{.point_count = 2000, .noise_px = 0.5, .planar = true, .seed = seed};
    asked += ErrorByTheMiddle(scene, MapperOptions().deviation_share_max);
    unasked += ErrorByTheMiddle(scene, 1e9);
  }
  EXPECT_GT(asked, 0);
  EXPECT_LT(asked, 0.5 * unasked);
}

TEST_F(PoseSearchTest, MatchesThePlacedNeighboursAgain) {
  scene_.AddImages(0, 3);
  scene_.AddReconstruction({0, 1});
  SceneWork work(&scene_);
  const ImageId images[] = {ImageId(1), ImageId(2)};
  ASSERT_OK(work.loader.LoadImages(images));
  const auto putative =
      MatchPlacedNeighbors(work.context, *scene_.Photo(3), scene_.MatchesOf(3, {0, 1, 2}));
  ASSERT_OK(putative);
  ASSERT_EQ(putative->size(), 2u) << "image 3 has no pose";
  EXPECT_GE((*putative)[0].matches.size(), scene_.scene().Pair(0, 3).matches.size() * 9 / 10);
}

TEST_F(PoseSearchTest, WithoutPlacedNeighboursThereIsNoReason) {
  const PoseSearch search = Search(scene_.MatchesOf(3, {4, 5}), {});
  EXPECT_TRUE(search.found.empty());
  EXPECT_EQ(search.reason, Reason::kNone);
}

TEST_F(PoseSearchTest, TooFewPointsAreNamed) {
  const PoseSearch search = Search(Thinned(6), Thinned(6));
  EXPECT_TRUE(search.found.empty());
  EXPECT_EQ(search.reason, Reason::kTooFewStructurePoints);
  EXPECT_NE(search.detail.find("sees "), std::string::npos) << search.detail;
}

TEST_F(PoseSearchTest, PointsOfElsewhereGiveNoPose) {
  auto shifted = scene_.MatchesOf(3, {0, 1, 2});
  for (PairMatches& pair : shifted) {
    pair.geometry = PairGeometry::kRotation;  // so that no baseline helps
    for (size_t i = 0; i < pair.matches.size(); ++i)
      pair.matches[i].a = pair.matches[(i + 7) % pair.matches.size()].a;
  }
  const PoseSearch search = Search(shifted, shifted);
  EXPECT_TRUE(search.found.empty());
  EXPECT_EQ(search.reason, Reason::kResectionFailed) << search.detail;
}

TEST_F(PoseSearchTest, AContradictedPoseIsDropped) {
  const auto matches = scene_.MatchesOf(3, {0, 1, 2});
  // Verified matches of another photo: they lie on other epipolar lines.
  auto wrong = scene_.MatchesOf(3, {0, 1, 2});
  for (PairMatches& pair : wrong) {
    for (FeatureMatch& match : pair.matches) match.b = (match.b + 40) % 100;
  }
  const PoseSearch search = Search(wrong, matches);
  EXPECT_TRUE(search.found.empty());
  EXPECT_EQ(search.reason, Reason::kContradictsNeighbors) << search.detail;
}

TEST_F(PoseSearchTest, FewPointsBesideManyUnplacedMatchesAreWeak) {
  auto verified = scene_.MatchesOf(3, {0, 1, 2, 4, 5});
  MapperOptions options;
  options.sure_inlier_count = 100'000;
  const PoseSearch search = Search(verified, Thinned(40), options);
  ASSERT_EQ(search.found.size(), 1u) << search.detail;
  EXPECT_TRUE(search.found.front().is_weak);
  EXPECT_EQ(search.reason, Reason::kTooFewStructurePoints);
  EXPECT_TRUE(IsGoodEnough(search.found.front(), options));
  options.weak_inlier_count_min = 100'000;
  EXPECT_FALSE(IsGoodEnough(search.found.front(), options));
}

}  // namespace
}  // namespace veduta
