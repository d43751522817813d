// SPDX-License-Identifier: Apache-2.0
// Goal: a pose is found among outliers, along a baseline from few points, and not where there is
//   none.
// Method: a synthetic scene of known truth, with outliers.
#include "engine/mapping/resection.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

TEST(Resection, FindsThePoseAmongOutliers) {
  const SyntheticScene scene = MakeScene({});
  SeededRandom random(5);
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (uint32_t f = 0; f < scene.seen[2].size(); ++f) {
    x.push_back(scene.camera.Normalize(scene.images[2].features->keypoints[f]));
    points.push_back(f % 2 ? scene.points[scene.seen[2][f]] : scene.points[random.Below(300)]);
  }
  const Resection found = Resect(x, points, 900, 1, {});
  ASSERT_EQ(found.outcome, ResectionOutcome::kPlaced);
  EXPECT_LT(RotationErrorDeg(found.cam_from_world, scene.poses[2]), 0.05);
  EXPECT_LT((found.cam_from_world.Center() - scene.poses[2].Center()).norm(), 0.01);
  EXPECT_GE(found.inliers.size(), scene.seen[2].size() / 2 - 2);
}

TEST(Resection, AlongABaselineFewPointsAreEnough) {
  const SyntheticScene scene = MakeScene({});
  SeededRandom random(6);
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (uint32_t f = 0; f < 24; ++f) {
    x.push_back(scene.camera.Normalize(scene.images[2].features->keypoints[f]));
    points.push_back(f % 2 ? scene.points[scene.seen[2][f]] : scene.points[random.Below(300)]);
  }
  Rigid3 cam_from_neighbor = scene.poses[2] * scene.poses[1].Inverse();
  cam_from_neighbor.translation.normalize();
  const ResectionOptions options = {.inlier_count_min = 10, .inlier_share_min = 0.35};
  const Resection found = ResectAlong(cam_from_neighbor, scene.poses[1], x, points, 900, options);
  ASSERT_EQ(found.outcome, ResectionOutcome::kPlaced);
  EXPECT_LT(RotationErrorDeg(found.cam_from_world, scene.poses[2]), 0.1);
  EXPECT_LT((found.cam_from_world.Center() - scene.poses[2].Center()).norm(), 0.02);
  // Backwards there is no length that fits, and not with points of elsewhere.
  cam_from_neighbor.translation *= -1;
  EXPECT_EQ(ResectAlong(cam_from_neighbor, scene.poses[1], x, points, 900, options).outcome,
            ResectionOutcome::kTooFewInliers);
  cam_from_neighbor.translation *= -1;
  for (Eigen::Vector3d& point : points) point = scene.points[random.Below(300)];
  EXPECT_EQ(ResectAlong(cam_from_neighbor, scene.poses[1], x, points, 900, options).outcome,
            ResectionOutcome::kTooFewInliers);
}

TEST(Resection, WhatLiesFarFromWhereAPosePutsItIsARival) {
  const SyntheticScene scene = MakeScene({});
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (const double off_px : {0.0, 14.0, 16.0, 0.0}) {
    points.push_back(scene.points[x.size()]);
    const Eigen::Vector3d seen = scene.poses[2] * points.back();
    x.push_back(seen.hnormalized() + Eigen::Vector2d(0, off_px / 900));
  }
  points.back() = scene.poses[2].Center() * 2;  // behind the camera
  EXPECT_EQ(ListRivals(scene.poses[2], x, points, 900, {}), (std::vector<uint32_t>{2, 3}));
}

TEST(Resection, RefusesUnrelatedPoints) {
  SeededRandom random(5);
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    x.push_back({random.Unit() - 0.5, random.Unit() - 0.5});
    points.push_back({random.Unit(), random.Unit(), random.Unit()});
  }
  EXPECT_EQ(Resect(x, points, 900, 1, {}).outcome, ResectionOutcome::kTooFewInliers);
  x.resize(10);
  points.resize(10);
  EXPECT_EQ(Resect(x, points, 900, 1, {}).outcome, ResectionOutcome::kTooFewMatches);
}

}  // namespace
}  // namespace veduta
