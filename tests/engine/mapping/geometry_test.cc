// SPDX-License-Identifier: Apache-2.0
// Goal: triangulation, resection and similarity return the truth within what noise allows, and
//   refuse what is degenerate.
// Method: a synthetic scene of known truth (synthetic_scene.h), outliers added where the
//   estimator must resist them.
#include <gtest/gtest.h>

#include "engine/mapping/resection.h"
#include "engine/mapping/similarity.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

TEST(Triangulation, IsExactWithoutNoise) {
  SceneOptions options;
  options.noise_px = 0;
  const SyntheticScene scene = MakeScene(options);
  for (uint32_t f = 0; f < scene.seen[0].size(); ++f) {
    const uint32_t point = scene.seen[0][f];
    if (scene.feature_of[3][point] < 0) continue;
    const Sighting views[] = {scene.images[0].ViewOf(f),
                              scene.images[3].ViewOf(scene.feature_of[3][point])};
    const auto found = Triangulate(views);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((*found - scene.points[point]).norm(), 1e-3);  // keypoints are floats
  }
}

TEST(Triangulation, RefusesParallelRaysAndPointsBehind) {
  Sighting a, b;
  b.cam_from_world.translation.x() = -1;
  EXPECT_FALSE(Triangulate(std::vector{a, b}).has_value());  // both look straight ahead
  a.x_px.x() = -0.5;                                         // the rays diverge: they meet behind
  b.x_px.x() = 0.5;
  EXPECT_FALSE(Triangulate(std::vector{a, b}).has_value());
}

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

TEST(Resection, RefusesUnrelatedPoints) {
  SeededRandom random(5);
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    x.emplace_back(random.Unit() - 0.5, random.Unit() - 0.5);
    points.emplace_back(random.Unit(), random.Unit(), random.Unit());
  }
  EXPECT_EQ(Resect(x, points, 900, 1, {}).outcome, ResectionOutcome::kTooFewInliers);
  x.resize(10);
  points.resize(10);
  EXPECT_EQ(Resect(x, points, 900, 1, {}).outcome, ResectionOutcome::kTooFewMatches);
}

TEST(Similarity, IsExactAndRobust) {
  const Sim3 b_from_a{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized())),
      {1, -2, 3}};
  SeededRandom random(2);
  std::vector<Eigen::Vector3d> a, b;
  for (int i = 0; i < 60; ++i) {
    a.emplace_back(random.Unit(), random.Unit(), random.Unit());
    b.push_back(i % 3 ? b_from_a * a.back()
                      : Eigen::Vector3d(9 * random.Unit(), 9 * random.Unit(), 9 * random.Unit()));
  }
  const auto near = [&](const Sim3& fit, size_t i) { return (fit * a[i] - b[i]).norm() < 0.01; };
  const auto found = EstimateSimilarity(a, b, near, 20, 7);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->inliers.size(), 40u);
  EXPECT_NEAR(found->b_from_a.scale, 2.5, 1e-9);
  EXPECT_LT((found->b_from_a.translation - b_from_a.translation).norm(), 1e-9);
  EXPECT_FALSE(EstimateSimilarity(a, b, near, 41, 7).has_value());
}

TEST(Similarity, RefusesALine) {
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 0, 0);
  EXPECT_FALSE(FitSimilarity(line, line).has_value());
}

TEST(Transforms, CameraFollowsItsWorld) {
  const SyntheticScene scene = MakeScene({});
  const Sim3 new_from_old{
      0.5, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ())), {4, 5, 6}};
  const Rigid3 moved = TransformCameraWorld(new_from_old, scene.poses[1]);
  const Eigen::Vector3d before = scene.poses[1] * scene.points[7],
                        after = moved * (new_from_old * scene.points[7]);
  EXPECT_LT((before.hnormalized() - after.hnormalized()).norm(), 1e-12);
}

}  // namespace
}  // namespace veduta
