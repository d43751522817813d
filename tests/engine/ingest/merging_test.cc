// SPDX-License-Identifier: Apache-2.0
// Goal: reconstructions that share places become one, in the frame of the larger; ones that do not
//   stay apart.
// Method: one synthetic scene stored as two reconstructions in different frames.
#include "engine/ingest/merging.h"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "engine/earth/earth_pose.h"
#include "engine/ingest/far_apart.h"
#include "engine/ingest/forbidding.h"
#include "engine/ingest/seam.h"
#include "engine/ingest/seam_loop.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

// Merges around image 5 (camera 4), which `own` holds already.
MergeOutcome Merge(SceneDatabase* scene, SceneWork* work, ReconstructionId own,
                   const std::vector<ImageId>& members) {
  EXPECT_OK(work->loader.LoadNeighborhood(members));
  const std::vector<ImageId> fresh = {ImageId(5)};
  auto merged = MergeAround(work->context, {own, false, fresh}, members,
                            scene->MatchesOf(4, {0, 1, 2, 3}), 1);
  EXPECT_OK(merged);
  return merged.ok() ? *merged : MergeOutcome();
}

TEST(Merging, TheLargerKeepsItsFrame) {
  SceneDatabase scene({.camera_count = 7});
  scene.AddImages(0, 7);
  const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
  SceneWork work(&scene);
  const MergeOutcome merged = Merge(&scene, &work, small, {ImageId(5), ImageId(6)});
  EXPECT_EQ(merged.into, large);
  ASSERT_EQ(merged.merges.size(), 1u);
  EXPECT_EQ(merged.merges[0].from, small);
  EXPECT_GE(merged.merges[0].common_point_count, 20u);
  // To what the noise of the keypoints leaves.
  EXPECT_NEAR(merged.merges[0].into_from.scale, 2, 2e-3);
  for (const uint32_t k : {4u, 5u}) {
    const MapImage& image = work.map.image(ImageId(k + 1));
    EXPECT_EQ(image.reconstruction, large);
    EXPECT_LT((image.cam_from_world.Center() - scene.scene().poses[k].Center()).norm(), 2e-3);
  }
  EXPECT_EQ(work.map.image(ImageId(1)).cam_from_world.translation,
            scene.scene().poses[0].translation);
  // A place that both knew is one point now.
  size_t joined = 0;
  const ImageId first[] = {ImageId(1)};
  for (const PointId id : work.map.PointsSeenBy(first)) {
    const auto& track = work.map.point(id).track;
    joined += std::any_of(track.begin(), track.end(),
                          [](const TrackElement& e) { return e.image == ImageId(5); });
  }
  EXPECT_GE(joined, 20u);
}

// The photo joins three: it is not the one of the lowest number that decides whose frame stays.
TEST(Merging, TheLargestOfThreeKeepsItsFrame) {
  SceneDatabase scene({.camera_count = 9});
  scene.AddImages(0, 9);
  const ReconstructionId middle = scene.AddReconstruction({6, 7, 8}, AnotherFrame());
  const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
  SceneWork work(&scene);
  const MergeOutcome merged = Merge(&scene, &work, small, {ImageId(5), ImageId(6)});
  EXPECT_EQ(merged.into, large);
  ASSERT_EQ(merged.merges.size(), 2u);
  EXPECT_EQ(merged.merges[0].from, small);
  EXPECT_EQ(merged.merges[1].from, middle);
  EXPECT_EQ(work.map.image(ImageId(1)).cam_from_world.translation,
            scene.scene().poses[0].translation);
}

// Gives a reconstruction, whose frame differs from the scene's by this similarity, a place on the
// earth that is off by `east_m`.
void PutPlace(ReconstructionId id, const Sim3& scene_from_world, double east_m, double deviation_m,
              SceneDatabase* scene) {
  ReconstructionRecord record = *scene->Snap()->GetReconstruction(id);
  EarthPlace& place = record.georeference.place.emplace();
  record.georeference.version = 1;
  place.origin = {47, 15, 350};
  const Sim3 enu_from_scene{10, Eigen::Quaterniond::Identity(), {east_m, 0, 0}};
  place.enu_from_world = enu_from_scene * scene_from_world;
  place.pivot = place.enu_from_world.translation;
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  covariance.diagonal() << 1e-6, 1e-6, 1e-6, 1e-6, 1, 1, 1;
  covariance.diagonal().tail<3>() *= deviation_m * deviation_m;
  place.covariance = PackCovariance(covariance);
  const auto transaction = scene->database()->BeginTransaction();
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
}

TEST(Merging, WhatTheEarthHasFarApartStaysApart) {
  struct Case {
    double east_m, deviation_m;
    bool is_far;
  };
  for (const auto& [east_m, deviation_m, is_far] :
       {Case{80, 5, true}, Case{-80, 5, true}, Case{15, 5, false}, Case{80, 30, false}}) {
    SceneDatabase scene({.camera_count = 7});
    scene.AddImages(0, 7);
    const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
    const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
    PutPlace(large, {}, 0, deviation_m, &scene);
    PutPlace(small, AnotherFrame().Inverse(), east_m, deviation_m, &scene);
    SceneWork work(&scene);
    const MergeOutcome merged = Merge(&scene, &work, small, {ImageId(5), ImageId(6)});
    EXPECT_EQ(merged.merges.empty(), is_far) << east_m << " " << deviation_m;
    if (!is_far) continue;
    ASSERT_EQ(merged.refused.size(), 1u);
    EXPECT_EQ(merged.refused[0].hypothesis->reason, RefusalReason::kFarApart);
    EXPECT_NE(merged.refused[0].evidence.find("on the earth are 80 m"), std::string::npos)
        << merged.refused[0].evidence;
  }
}

// That the two are one, by a seam that is judged with each photo.
HypothesisRecord SmallHypothesis(ReconstructionId a, ReconstructionId b) {
  HypothesisRecord hypothesis;
  hypothesis.a = a;
  hypothesis.b = b;
  hypothesis.judged_cells = 20;
  hypothesis.images = {ImageId(1), ImageId(5)};
  return hypothesis;
}

void Put(const HypothesisRecord& hypothesis, SceneDatabase* scene) {
  const auto transaction = scene->database()->BeginTransaction();
  transaction->PutHypothesis(hypothesis);
  ASSERT_OK(transaction->Commit());
}

// The two are a hypothesis already, for which so many pairs across spoke.
void PutHypothesis(SceneDatabase* scene, ReconstructionId a, ReconstructionId b, uint32_t pairs,
                   uint32_t judged_cells = 300, RefusalReason reason = RefusalReason::kFewPairs) {
  HypothesisRecord hypothesis = SmallHypothesis(a, b);
  hypothesis.agreeing_pairs = pairs;
  hypothesis.judged_cells = judged_cells;
  hypothesis.reason = reason;
  Put(hypothesis, scene);
}

TEST(Merging, AKnownHypothesisIsNotJudgedButToldToHaveGrown) {
  SceneDatabase scene({.camera_count = 7});
  scene.AddImages(0, 7);
  const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
  for (const uint32_t pairs : {1u, 100u}) {
    PutHypothesis(&scene, large, small, pairs);
    SceneWork work(&scene);
    const std::vector<ImageId> members = {ImageId(5), ImageId(6)};
    const MergeOutcome outcome = Merge(&scene, &work, small, members);
    EXPECT_TRUE(outcome.merges.empty());
    EXPECT_TRUE(outcome.refused.empty());
    ASSERT_EQ(outcome.known.size(), 1u);
    EXPECT_EQ(outcome.known[0].own, small);
    EXPECT_EQ(outcome.known[0].other, large);
    EXPECT_EQ(outcome.known[0].has_grown, pairs == 1);
    // Whoever asks for it alone has it judged.
    const auto asked = MergeAround(work.context, {small, false, {}, large}, members, {}, 1);
    ASSERT_OK(asked);
    EXPECT_EQ(asked->merges.size(), 1u);
  }
}

TEST(Merging, WhatWasSplitIsNotMergedAgainByTheNextPhoto) {
  SceneDatabase scene({.camera_count = 7});
  scene.AddImages(0, 7);
  const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
  for (const RefusalReason reason : {RefusalReason::kSplit, RefusalReason::kContradicted}) {
    PutHypothesis(&scene, large, small, 100, 20, reason);
    SceneWork work(&scene);
    const MergeOutcome outcome = Merge(&scene, &work, small, {ImageId(5), ImageId(6)});
    const bool is_split = reason == RefusalReason::kSplit;
    EXPECT_EQ(outcome.merges.size(), is_split ? 0u : 1u);
    ASSERT_EQ(outcome.known.size(), is_split ? 1u : 0u);
    EXPECT_FALSE(is_split && outcome.known[0].has_grown);
  }
}

TEST(Merging, WhatManyPairsRefuteIsNotJudgedWithEachPhoto) {
  SceneDatabase scene({.camera_count = 7});
  scene.AddImages(0, 7);
  const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
  for (const auto& [agreeing, contradicting, is_refuted] :
       {std::tuple(1u, 40u, true), {20u, 40u, false}, {1u, 5u, false}}) {
    HypothesisRecord hypothesis = SmallHypothesis(large, small);
    hypothesis.agreeing_pairs = agreeing;
    hypothesis.contradicting_pairs = contradicting;
    hypothesis.reason = RefusalReason::kContradicted;
    Put(hypothesis, &scene);
    SceneWork work(&scene);
    const MergeOutcome outcome = Merge(&scene, &work, small, {ImageId(5), ImageId(6)});
    EXPECT_EQ(outcome.known.size(), is_refuted ? 1u : 0u) << contradicting;
    EXPECT_EQ(outcome.merges.size(), is_refuted ? 0u : 1u) << contradicting;
  }
}

TEST(Merging, TooFewCommonPointsStayApart) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId own = scene.AddReconstruction({4, 5}, AnotherFrame());
  SceneWork work(&scene);
  work.options.common_points_min = 100'000;
  work.options.view_alignment.other_sightings_min = 100'000;
  const MergeOutcome merged = Merge(&scene, &work, own, {ImageId(5), ImageId(6)});
  EXPECT_EQ(merged.into, own);
  EXPECT_TRUE(merged.merges.empty());
  EXPECT_EQ(work.map.image(ImageId(5)).reconstruction, own);
}

TEST(Merging, WhatCamerasSeeOfTheOtherSideServesWithoutCommonPoints) {
  SceneDatabase scene({.camera_count = 8, .point_count = 2000});
  scene.AddImages(0, 8);
  const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
  SceneWork work(&scene);
  work.options.common_points_min = 100'000;
  const MergeOutcome merged = Merge(&scene, &work, small, {ImageId(5), ImageId(6)});
  EXPECT_EQ(merged.into, large);
  ASSERT_EQ(merged.merges.size(), 1u);
  EXPECT_EQ(merged.merges[0].common_point_count, 0u);
  EXPECT_NEAR(merged.merges[0].into_from.scale, 2, 2e-3);
}

TEST(Merging, WhatSomebodyHasForbiddenStaysApart) {
  SceneDatabase scene({.camera_count = 7});
  scene.AddImages(0, 7);
  const ReconstructionId large = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId small = scene.AddReconstruction({4, 5}, AnotherFrame());
  ASSERT_OK(Forbid({ForbiddenKind::kMerge, small.value, large.value, 0, "bea", ""},
                   BeginWrite(scene.database())));
  SceneWork work(&scene);
  MergeOutcome merged = Merge(&scene, &work, small, {ImageId(5), ImageId(6)});
  EXPECT_TRUE(merged.merges.empty());
  ASSERT_EQ(merged.refused.size(), 1u);
  EXPECT_EQ(merged.refused[0].other, large);
  EXPECT_NE(merged.refused[0].evidence.find("forbidden"), std::string::npos);
  ASSERT_OK(Allow(ForbiddenKind::kMerge, small.value, large.value, "bea", "",
                  BeginWrite(scene.database())));
  SceneWork again(&scene);
  merged = Merge(&scene, &again, small, {ImageId(5), ImageId(6)});
  EXPECT_EQ(merged.merges.size(), 1u);
}

// The seam that a loop tells leads one pair further than what closing the loop has loaded.
TEST(Merging, ALoopLoadsWhatItGrows) {
  SceneDatabase scene({.camera_count = 14, .point_count = 1200});
  scene.AddImages(0, 14);
  scene.LimitTracks(1);
  const std::vector<uint32_t> own = {0, 1, 8, 9, 10}, other = {4, 5, 12, 13};
  scene.AddReconstruction(own);
  scene.AddReconstruction(other, AnotherFrame());
  const std::set<std::pair<uint32_t, uint32_t>> across = {{0, 4}, {1, 4}, {1, 5}, {9, 5}};
  const auto transaction = scene.database()->BeginTransaction();
  for (const uint32_t a : own) {
    for (const uint32_t b : other) {
      if (!across.contains({a, b})) transaction->DeletePair(ImageId(a + 1), ImageId(b + 1));
    }
  }
  ASSERT_OK(transaction->Commit());
  SceneWork work(&scene);
  const std::vector<ImageId> near = {ImageId(1)};
  ASSERT_OK(work.loader.LoadNeighborhood(near));
  ASSERT_OK(FindSeam(&work.loader, work.map, near.front(), {}, near, ReconstructionId(2)).status());
  const ClosedLoop closed{{{ReconstructionId(2), AnotherFrame().Inverse()}},
                          {{ReconstructionId(1), ReconstructionId(2), {ImageId(1), ImageId(2)}}},
                          "made by hand"};
  const auto merged = MergeLoop(work.context, ReconstructionId(1), closed);
  ASSERT_OK(merged);
  EXPECT_EQ(merged->merges.size(), 1u);
  EXPECT_EQ(work.map.image(ImageId(5)).reconstruction, ReconstructionId(1));
}

}  // namespace
}  // namespace veduta
