// SPDX-License-Identifier: Apache-2.0
// Goal: adjustment finds the optimum, holds what it should hold, keeps the frame, and repeats bit for bit.
// Method: a synthetic map disturbed from the truth; derivatives are checked against numeric ones.
#include "engine/mapping/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <array>

#include "engine/mapping/point_filter.h"
#include "engine/mapping/reprojection_cost.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

std::vector<ImageId> AllImages(const Map& map) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  return ids;
}

void Disturb(Map* map, double amount, uint64_t seed) {
  SeededRandom random(seed);
  const auto small = [&] { return amount * (2 * random.Unit() - 1); };
  for (const ImageId id : AllImages(*map)) {
    Rigid3 pose = map->image(id).cam_from_world;
    pose.rotation = (Eigen::Quaterniond(1, small() / 10, small() / 10, small() / 10) * pose.rotation).normalized();
    pose.translation += Eigen::Vector3d(small(), small(), small());
    map->SetPose(id, pose);
  }
  for (const PointId id : map->PointsSeenBy(AllImages(*map))) {
    map->SetPosition(id, map->point(id).position + Eigen::Vector3d(small(), small(), small()));
  }
}

double MeanError(const Map& map) {
  double sum = 0;
  const auto points = map.PointsSeenBy(AllImages(map));
  for (const PointId id : points) sum += map.point(id).error_px;
  return sum / static_cast<double>(points.size());
}

TEST(ReprojectionCost, DerivativesAreTheNumericOnes) {
  const ReprojectionCost cost(MakeScene({}).camera, {480, 420});
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, -2, 0.5).normalized()));
  std::array<double, 7> pose = {q.x(), q.y(), q.z(), q.w(), 0.3, -0.2, 6};
  std::array<double, 3> point = {0.5, -0.4, 1.2};
  const double* parameters[] = {pose.data(), point.data()};
  double residuals[2], by_pose[14], by_point[6];
  double* jacobians[] = {by_pose, by_point};
  ASSERT_TRUE(cost.Evaluate(parameters, residuals, jacobians));
  const PoseManifold manifold;
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    double high[2], low[2];
    for (const int sign : {1, -1}) {
      std::array<double, 6> delta{};
      delta[k] = sign * kStep;
      std::array<double, 7> moved;
      manifold.Plus(pose.data(), delta.data(), moved.data());
      const double* at[] = {moved.data(), point.data()};
      cost.Evaluate(at, sign > 0 ? high : low, nullptr);
    }
    for (int r = 0; r < 2; ++r) EXPECT_NEAR(by_pose[7 * r + k], (high[r] - low[r]) / (2 * kStep), 1e-3) << k;
  }
  for (int k = 0; k < 3; ++k) {
    double high[2], low[2];
    for (const int sign : {1, -1}) {
      std::array<double, 3> moved = point;
      moved[k] += sign * kStep;
      const double* at[] = {pose.data(), moved.data()};
      cost.Evaluate(at, sign > 0 ? high : low, nullptr);
    }
    for (int r = 0; r < 2; ++r) EXPECT_NEAR(by_point[3 * r + k], (high[r] - low[r]) / (2 * kStep), 1e-3) << k;
  }
}

TEST(BundleAdjustment, FindsTheTruthAndKeepsTheFrame) {
  const SyntheticScene scene = MakeScene({});
  Map map = MakeMap(scene);
  Disturb(&map, 0.05, 3);
  EXPECT_GT(MeanError(map), 3.0);
  const auto summary = AdjustBundle(&map, AllImages(map), map.PointsSeenBy(AllImages(map)), {});
  ASSERT_TRUE(summary.ok());
  EXPECT_LT(MeanError(map), 0.45);  // noise of 0.3 px in each coordinate
  for (uint32_t k = 0; k < scene.poses.size(); ++k) {
    const Rigid3& pose = map.image(scene.images[k].id).cam_from_world;
    EXPECT_LT((pose.Center() - scene.poses[k].Center()).norm(), 0.1);  // as near as the disturbed frame was
    EXPECT_LT(RotationErrorDeg(pose, scene.poses[k]), 1.0);
  }
}

TEST(BundleAdjustment, HoldsImagesThatAreNotFree) {
  const SyntheticScene scene = MakeScene({});
  Map map = MakeMap(scene);
  const ImageId free[] = {ImageId(3)};
  Rigid3 wrong = scene.poses[2];
  wrong.translation.x() += 0.05;
  map.SetPose(ImageId(3), wrong);
  ASSERT_TRUE(AdjustBundle(&map, free, map.PointsSeenBy(free), {}).ok());
  EXPECT_EQ(map.image(ImageId(1)).cam_from_world.translation, scene.poses[0].translation);
  EXPECT_LT((map.image(ImageId(3)).cam_from_world.Center() - scene.poses[2].Center()).norm(), 0.01);
}

TEST(BundleAdjustment, RepeatsBitForBit) {
  Rigid3 first;
  for (int run = 0; run < 2; ++run) {
    Map map = MakeMap(MakeScene({}));
    Disturb(&map, 0.03, 8);
    ASSERT_TRUE(AdjustBundle(&map, AllImages(map), map.PointsSeenBy(AllImages(map)), {}).ok());
    const Rigid3 pose = map.image(ImageId(4)).cam_from_world;
    if (run == 0) first = pose;
    EXPECT_EQ(pose.translation, first.translation);
    EXPECT_EQ(pose.rotation.coeffs(), first.rotation.coeffs());
  }
}

TEST(PointFilter, RemovesWrongObservationsAndFlatPoints) {
  const SyntheticScene scene = MakeScene({});
  Map map = MakeMap(scene);
  const auto points = map.PointsSeenBy(AllImages(map));
  const PointId moved = points[3], kept = points[5];
  ASSERT_GE(map.point(moved).track.size(), 3u);
  map.SetPosition(moved, map.point(moved).position + Eigen::Vector3d(0, 0.5, 0));
  const PointFilterCounts counts = FilterPoints(&map, points, {});
  EXPECT_EQ(map.FindPoint(moved), nullptr);
  EXPECT_NE(map.FindPoint(kept), nullptr);
  EXPECT_GE(counts.points_removed, 1u);
  EXPECT_LT(counts.points_removed, 10u);
  PointFilterOptions wide;
  wide.angle_deg_min = 80;  // nothing is seen from so far apart
  FilterPoints(&map, points, wide);
  EXPECT_TRUE(map.PointsSeenBy(AllImages(map)).empty());
}

}  // namespace
}  // namespace veduta
