// SPDX-License-Identifier: Apache-2.0
// Goal: the score of a localised photo is its error in metres and degrees of the truth, whatever
//   the frame, and the squares by its covariance; what was not localised is told with its reason.
// Method: cameras of known truth in another frame, one of which is moved and turned by known
//   amounts and claims known deviations.
#include "tools/bench/localization/localization_score.h"

#include <gtest/gtest.h>

namespace veduta::localization {
namespace {

constexpr double kScale = 0.5;

std::string Name(int i) {
  return std::to_string(i) + ".jpg";
}

orders::Truth Circle() {
  orders::Truth truth;
  for (int i = 0; i < 6; ++i) {
    Rigid3 camera;
    camera.rotation = Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d(0, 1, 0));
    camera.translation = -(camera.rotation * Eigen::Vector3d(3 * i, 0.1 * i * i, 0.4 * i));
    truth[Name(i)] = camera;
  }
  return truth;
}

Pose InTheWorld(const Rigid3& truth) {
  Sim3 world_from_truth;
  world_from_truth.scale = kScale;
  world_from_truth.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized());
  world_from_truth.translation = {3, -2, 5};
  return {1, TransformCameraWorld(world_from_truth, truth)};
}

// The last photo, moved along its own axis and turned around it.
LocalizedPhoto Asked(const Rigid3& truth, double moved_m, double turned_deg) {
  Rigid3 camera = truth;
  camera.rotation =
      Eigen::AngleAxisd(turned_deg * M_PI / 180, Eigen::Vector3d(0, 0, 1)) * truth.rotation;
  camera.translation =
      -(camera.rotation *
        (truth.Center() + moved_m * (truth.rotation.conjugate() * Eigen::Vector3d(0, 0, 1))));
  const Rigid3 pose = InTheWorld(camera).cam_from_world;
  LocalizedPhoto photo;
  photo.name = Name(5);
  photo.verdict = Verdict::kPlaced;
  photo.reconstruction = ReconstructionId(1);
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d center = pose.Center();
  photo.cam_from_world =
      PlainPose{{q.w(), q.x(), q.y(), q.z()},
                {pose.translation.x(), pose.translation.y(), pose.translation.z()},
                {center.x(), center.y(), center.z()}};
  for (int i = 1; i < 5; ++i) photo.support.push_back({ImageId(1), Name(i), 30});
  photo.uncertainty.emplace();
  for (size_t i = 0; i < 6; ++i)
    photo.uncertainty->covariance[i][i] = i < 3 ? std::pow(M_PI / 180, 2) : 0.01;
  return photo;
}

TEST(LocalizationScore, ErrorsAndSquaresAreThoseMade) {
  const orders::Truth truth = Circle();
  LocalizationRun run;
  for (int i = 0; i < 5; ++i) run.before[Name(i)] = InTheWorld(truth.at(Name(i)));
  run.after = run.before;
  run.after[Name(5)] = InTheWorld(truth.at(Name(5)));
  run.asked = {Asked(truth.at(Name(5)), 0.4, 3)};
  // Far away the frame is bent: that does not touch what is nearby.
  run.before[Name(0)].cam_from_world.translation.x() += 0.2;
  const std::vector<PhotoScore> scores = ScoreLocalization(run, truth);
  ASSERT_EQ(scores.size(), 1u);
  ASSERT_TRUE(scores[0].nearby);
  EXPECT_NEAR(scores[0].nearby->center_m, 0.4, 1e-6);
  EXPECT_NEAR(scores[0].nearby->rotation_deg, 3, 1e-4);
  ASSERT_TRUE(scores[0].error && scores[0].adjusted && scores[0].center_squares);
  EXPECT_GT(std::abs(scores[0].error->center_m - 0.4), 1e-3);
  EXPECT_NEAR(scores[0].error->center_m, 0.4, 0.2);
  EXPECT_NEAR(scores[0].adjusted->center_m, 0, 1e-6);
  EXPECT_NEAR(scores[0].adjusted->rotation_deg, 0, 1e-4);
  // 0.4 m are 0.2 units of the world, two deviations; 3 degrees are three.
  EXPECT_NEAR(*scores[0].center_squares, 4, 1e-4);
  EXPECT_NEAR(*scores[0].pose_squares, 4 + 9, 1e-3);
  EXPECT_NE(Summary(scores).find("centre inside the 95 % ellipsoid: 1 of 1"), std::string::npos);
  EXPECT_NE(Summary(scores).find("pose inside the 95 % ellipsoid: 0 of 1"), std::string::npos);
  EXPECT_NE(PhotoText(scores[0]).find("nearby 0.4000 m 3.0000 degrees"), std::string::npos)
      << PhotoText(scores[0]);
}

TEST(LocalizationScore, WhatIsNotLocalisedHasNoError) {
  const orders::Truth truth = Circle();
  LocalizationRun run;
  for (int i = 0; i < 2; ++i) run.before[Name(i)] = InTheWorld(truth.at(Name(i)));
  LocalizedPhoto refused;
  refused.name = Name(4);
  refused.verdict = Verdict::kPostponed;
  refused.reason = Reason::kAmbiguous;
  run.asked = {refused, Asked(truth.at(Name(5)), 0, 0)};
  const std::vector<PhotoScore> scores = ScoreLocalization(run, truth);
  ASSERT_EQ(scores.size(), 2u);
  EXPECT_EQ(scores[0].verdict, ReasonSentence(Reason::kAmbiguous, ""));
  EXPECT_FALSE(scores[0].error || scores[0].adjusted);
  EXPECT_FALSE(scores[1].error) << "two photos fit no similarity";
  EXPECT_NE(Summary(scores).find("localised and scored: 0 of 2 photos"), std::string::npos);
}

}  // namespace
}  // namespace veduta::localization
