// SPDX-License-Identifier: Apache-2.0
// Goal: a run's score finds each photo that is off and blames no other.
// Method: cameras of known truth in another frame and scale, some of them moved or turned by known
//   amounts.
#include "tools/bench/orders/order_score.h"

#include <gtest/gtest.h>

#include "storage/base/content_hash.h"
#include "tools/bench/orders/order_report.h"

namespace veduta::orders {
namespace {

constexpr Limits kLimits = {0.5, 2};

std::string Name(int i) {
  return "photo" + std::to_string(100 + i) + ".jpg";
}

// Cameras in a courtyard of 30 m, looking anywhere.
Truth Courtyard(int count) {
  SeededRandom random(7);
  const auto coordinate = [&] { return 30 * random.Unit() - 15; };
  Truth truth;
  for (int i = 0; i < count; ++i) {
    Rigid3 camera;
    const Eigen::Vector3d axis(coordinate(), coordinate(), coordinate());
    camera.rotation = Eigen::AngleAxisd(3 * random.Unit(), axis.normalized());
    camera.translation = -(camera.rotation * Eigen::Vector3d(coordinate(), coordinate(), 0.1 * i));
    truth[Name(i)] = camera;
  }
  return truth;
}

// Photos [first, last) as a reconstruction in a frame of its own has them.
void AddReconstruction(const Truth& truth, uint32_t id, int first, int last, OrderRun* run) {
  Sim3 from_truth;
  from_truth.scale = 0.2 + 0.1 * id;
  from_truth.rotation = Eigen::AngleAxisd(0.7 * id, Eigen::Vector3d(1, 2, -1).normalized());
  from_truth.translation = Eigen::Vector3d(3, -2, 5.0 * id);
  for (int i = first; i < last; ++i) {
    run->poses.push_back({Name(i), id, TransformCameraWorld(from_truth, truth.at(Name(i)))});
    ++run->placed;
  }
}

OrderRun MakeRun(const Truth& truth, int count) {
  OrderRun run;
  run.label = "seed 1";
  run.photos = static_cast<uint32_t>(count);
  AddReconstruction(truth, 1, 0, count, &run);
  return run;
}

// Moves a photo's centre by so many metres of the truth.
void Move(OrderRun* run, int photo, double metres) {
  Rigid3& camera = run->poses[static_cast<size_t>(photo)].cam_from_world;
  camera.translation += Eigen::Vector3d(0.6, 0, 0.8) * metres * 0.3;  // the scale is 0.3
}

void Turn(OrderRun* run, int photo, double degrees) {
  Rigid3& camera = run->poses[static_cast<size_t>(photo)].cam_from_world;
  const Eigen::Vector3d center = camera.Center();
  camera.rotation =
      Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitY()) * camera.rotation;
  camera.translation = -(camera.rotation * center);
}

TEST(OrderScore, ATrueRunHasNoError) {
  const Truth truth = Courtyard(20);
  const OrderScore score = ScoreRun(MakeRun(truth, 20), truth, kLimits);
  ASSERT_EQ(score.reconstructions.size(), 1u);
  EXPECT_EQ(score.reconstructions[0].photos, 20u);
  EXPECT_TRUE(score.reconstructions[0].is_fitted);
  EXPECT_LT(score.all.center_max_m, 1e-9);
  EXPECT_LT(score.all.rotation_max_deg, 1e-5);
  EXPECT_EQ(score.all.wrong, 0u);
  EXPECT_EQ(score.all.wrong_robust, 0u);
  EXPECT_FALSE(score.is_wrong);
}

TEST(OrderScore, APhotoThatIsOffIsNamed) {
  const Truth truth = Courtyard(20);
  OrderRun moved = MakeRun(truth, 20);
  Move(&moved, 4, 1);
  const OrderScore far = ScoreRun(moved, truth, kLimits);
  EXPECT_TRUE(far.is_wrong);
  EXPECT_EQ(far.all.wrong, 1u);
  EXPECT_EQ(far.all.wrong_robust, 1u);
  EXPECT_EQ(far.all.worst, Name(4));
  EXPECT_NEAR(far.all.center_max_m, 1, 0.2);  // the fit follows it a little
  EXPECT_LT(far.all.rotation_max_deg, 1);

  OrderRun turned = MakeRun(truth, 20);
  Turn(&turned, 9, 2.5);
  const OrderScore skew = ScoreRun(turned, truth, kLimits);
  EXPECT_TRUE(skew.is_wrong);
  EXPECT_EQ(skew.all.worst, Name(9));
  EXPECT_NEAR(skew.all.rotation_max_deg, 2.5, 1e-5);
  EXPECT_LT(skew.all.center_max_m, 1e-9);
  EXPECT_FALSE(ScoreRun(turned, truth, {0.5, 2.6}).is_wrong);
}

TEST(OrderScore, TheRobustFitBlamesNoOther) {
  const Truth truth = Courtyard(20);
  OrderRun run = MakeRun(truth, 20);
  for (const int photo : {2, 3}) Move(&run, photo, 60);
  Move(&run, 11, 90);
  const OrderScore score = ScoreRun(run, truth, kLimits);
  EXPECT_GT(score.all.wrong, 10u);  // the three have bent the fit
  EXPECT_EQ(score.all.wrong_robust, 3u);
  EXPECT_EQ(score.all.worst, Name(11));
}

TEST(OrderScore, EachReconstructionHasItsOwnFit) {
  const Truth truth = Courtyard(20);
  OrderRun run;
  run.photos = 20;
  AddReconstruction(truth, 3, 0, 7, &run);
  AddReconstruction(truth, 5, 7, 18, &run);
  AddReconstruction(truth, 8, 18, 20, &run);
  const OrderScore score = ScoreRun(run, truth, kLimits);
  ASSERT_EQ(score.reconstructions.size(), 3u);
  EXPECT_EQ(score.reconstructions[0].reconstruction, 5u);
  EXPECT_EQ(score.reconstructions[0].photos, 11u);
  EXPECT_EQ(score.reconstructions[1].reconstruction, 3u);
  EXPECT_FALSE(score.reconstructions[2].is_fitted);  // two photos
  EXPECT_EQ(score.all.photos, 18u);
  EXPECT_LT(score.all.center_max_m, 1e-9);
  EXPECT_FALSE(score.is_wrong);
  // The same photos taken for one reconstruction are wrong.
  for (PlacedPhoto& placed : run.poses) placed.reconstruction = 1;
  EXPECT_TRUE(ScoreRun(run, truth, kLimits).is_wrong);
}

TEST(OrderScore, CentresOnALineLeaveTheRotationToTheRotations) {
  SeededRandom random(3);
  Truth truth;
  for (int i = 0; i < 6; ++i) {
    Rigid3 camera;
    camera.rotation = Eigen::AngleAxisd(0.4 * i, Eigen::Vector3d::UnitY());
    camera.translation = -(camera.rotation * Eigen::Vector3d(2 * i, 0.001 * random.Unit(), 0));
    truth[Name(i)] = camera;
  }
  OrderRun run = MakeRun(truth, 6);
  for (int i = 0; i < 6; ++i) Move(&run, i, 0.02 * random.Unit());
  const OrderScore score = ScoreRun(run, truth, kLimits);
  EXPECT_TRUE(score.reconstructions[0].is_rotation_apart);
  EXPECT_LT(score.all.rotation_max_deg, 0.1);
  EXPECT_FALSE(score.is_wrong);
  Turn(&run, 3, 5);
  EXPECT_EQ(ScoreRun(run, truth, kLimits).all.worst, Name(3));
  EXPECT_TRUE(ScoreRun(run, truth, kLimits).is_wrong);
}

TEST(OrderScore, AFailedRunAndPhotosWithoutTruth) {
  const Truth truth = Courtyard(20);
  OrderRun run = MakeRun(truth, 20);
  run.poses[3].name = "elsewhere/" + run.poses[3].name;  // known by its file name
  run.poses[5].name = "stranger.jpg";
  const OrderScore score = ScoreRun(run, truth, kLimits);
  EXPECT_EQ(score.without_truth, 1u);
  EXPECT_EQ(score.all.photos, 19u);
  EXPECT_FALSE(score.is_wrong);
  run.failure = "it burns";
  EXPECT_TRUE(ScoreRun(run, truth, kLimits).is_wrong);
  run.poses.clear();
  EXPECT_TRUE(ScoreRun(run, truth, kLimits).is_wrong);
}

TEST(OrderScore, TheLargerLimitHolds) {
  EXPECT_DOUBLE_EQ(CenterLimit({}, {}, 20), 0.5);
  EXPECT_DOUBLE_EQ(CenterLimit({}, {}, 200), 1);
  EXPECT_DOUBLE_EQ(CenterLimit(0.25, {}, 200), 0.25);
  EXPECT_DOUBLE_EQ(CenterLimit({}, 0.01, 20), 0.2);
  EXPECT_DOUBLE_EQ(CenterLimit(0.25, 0.01, 20), 0.25);
}

TEST(OrderReport, SumsUpAllOrders) {
  const Truth truth = Courtyard(20);
  std::vector<ScoredRun> runs;
  for (int i = 0; i < 10; ++i) {
    OrderRun run = MakeRun(truth, i == 7 ? 19 : 20);
    run.photos = 20;
    run.label = "seed " + std::to_string(i);
    run.seconds = i;
    if (i == 4) Move(&run, 2, 1);
    if (i == 6) Turn(&run, 2, 30);
    runs.push_back({run, ScoreRun(run, truth, kLimits)});
  }
  OrderRun failed;
  failed.label = "seed 10", failed.failure = "ended by signal 6: image 814 is not loaded";
  failed.photos = 20;
  runs.push_back({failed, ScoreRun(failed, truth, kLimits)});
  const OrdersSummary all = Summarize(runs, kLimits);
  EXPECT_EQ(all.orders, 11u);
  EXPECT_EQ(all.wrong, 3u);
  EXPECT_EQ(all.wrong_robust, 3u);
  EXPECT_EQ(all.failed, 1u);
  EXPECT_EQ(all.complete, 9u);
  EXPECT_EQ(all.worst, "seed 10");
  EXPECT_DOUBLE_EQ(all.placed_share.least, 0);
  EXPECT_DOUBLE_EQ(all.placed_share.median, 1);
  EXPECT_DOUBLE_EQ(all.seconds.median, 5);
  EXPECT_DOUBLE_EQ(all.seconds.most, 9);
  EXPECT_NEAR(all.rotation_max_deg.most, 30, 1e-4);
  EXPECT_EQ(Summarize(std::span(runs).first(10), kLimits).worst, "seed 6");

  EXPECT_NE(RunReport(runs[4]).find("WRONG"), std::string::npos);
  EXPECT_NE(RunReport(runs[4]).find("worst " + Name(2)), std::string::npos);
  EXPECT_NE(RunReport(runs[3]).find("right"), std::string::npos);
  EXPECT_NE(RunReport(runs[10]).find("image 814 is not loaded"), std::string::npos);
  EXPECT_NE(SummaryReport(all, kLimits).find("3 of 11 orders wrong (27.3 %"), std::string::npos);
}

}  // namespace
}  // namespace veduta::orders
