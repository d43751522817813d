// SPDX-License-Identifier: Apache-2.0
// Goal: points and the matches of placed neighbours together give a pose that the points alone
//   leave open, also where some of either are wrong.
// Method: a synthetic scene in which few points in the middle of the picture are known; the pose is
//   compared with the truth, and with the one by the points alone.
#include "engine/mapping/joint_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/mapping/resection.h"
#include "storage/base/content_hash.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

constexpr double kScale = 1.2 / 900;

// What is known of one view, 2, of a scene.
struct Known {
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  std::vector<PlacedMatches> neighbors;
};

// The points in the middle `part` of the picture, and the matches of these views in all of it.
Known KnownOf(const SyntheticScene& scene, double part,
              const std::vector<uint32_t>& neighbors = {0, 4}) {
  Known known;
  const std::vector<Keypoint>& keypoints = scene.images[2].features->keypoints;
  for (uint32_t f = 0; f < keypoints.size(); ++f) {
    if (std::abs(keypoints[f].x_px / SyntheticScene::kWidth - 0.5) > part / 2 ||
        std::abs(keypoints[f].y_px / SyntheticScene::kHeight - 0.5) > part / 2)
      continue;
    known.x.push_back(scene.camera.Normalize(keypoints[f]));
    known.points.push_back(scene.points[scene.seen[2][f]]);
  }
  for (const uint32_t other : neighbors) {
    PlacedMatches& matches = known.neighbors.emplace_back();
    matches.cam_from_world = scene.poses[other];
    matches.scale = kScale;
    for (const FeatureMatch& match : MatchesFrom(scene.Pair(2, other), ImageId(3)).matches) {
      matches.x.push_back(scene.camera.Normalize(keypoints[match.a]));
      matches.x_other.push_back(
          scene.camera.Normalize(scene.images[other].features->keypoints[match.b]));
    }
  }
  return known;
}

// Turned about the middle of the points, which it looks at, by some degrees.
Rigid3 OnTheArc(const Rigid3& pose, double degrees) {
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(degrees * 0.017453292519943295, Eigen::Vector3d::UnitY()));
  return {(pose.rotation * turn).normalized(), pose.translation};
}

double CenterError(const Rigid3& pose, const SyntheticScene& scene) {
  return (pose.Center() - scene.poses[2].Center()).norm();
}

TEST(JointPose, WithoutErrorsItIsTheTruth) {
  const SyntheticScene scene = MakeScene({.noise_px = 0});
  const Known known = KnownOf(scene, 1);
  const JointPose found =
      RefineJointly(OnTheArc(scene.poses[2], 2), known.x, known.points, known.neighbors, kScale);
  EXPECT_LT(CenterError(found.cam_from_world, scene), 1e-5);
  EXPECT_LT(RotationErrorDeg(found.cam_from_world, scene.poses[2]), 1e-4);
  EXPECT_LT(found.cost, 1e-3);
}

TEST(JointPose, MatchesCloseTheArcThatPointsLeaveOpen) {
  double by_points = 0, jointly = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const SyntheticScene scene =
        MakeScene({.point_count = 1000, .noise_px = 0.5, .planar = true, .seed = seed});
    const Known known = KnownOf(scene, 0.15);
    const Rigid3 start = OnTheArc(scene.poses[2], 3);
    by_points += CenterError(RefinePose(start, known.x, known.points, kScale), scene);
    jointly += CenterError(
        RefineJointly(start, known.x, known.points, known.neighbors, kScale).cam_from_world, scene);
  }
  EXPECT_LT(jointly, 0.2 * by_points);
  EXPECT_LT(jointly / 10, 0.02);
}

TEST(JointPose, WrongPointsAndMatchesAreOutvoted) {
  const SyntheticScene scene = MakeScene({.noise_px = 0.3});
  Known known = KnownOf(scene, 1);
  SeededRandom random(3);
  for (size_t i = 0; i < known.points.size(); i += 3)
    known.points[i] = scene.points[random.Below(300)];
  for (PlacedMatches& matches : known.neighbors) {
    for (size_t i = 0; i < matches.x.size(); i += 3)
      matches.x_other[i] = {random.Unit() - 0.5, random.Unit() - 0.5};
  }
  const JointPose found =
      RefineJointly(OnTheArc(scene.poses[2], 1), known.x, known.points, known.neighbors, kScale);
  EXPECT_LT(CenterError(found.cam_from_world, scene), 0.01);
}

// Puts a fifth of the matches elsewhere.
void MisleadMatches(uint64_t seed, std::vector<PlacedMatches>* neighbors) {
  SeededRandom random(seed);
  for (PlacedMatches& matches : *neighbors) {
    for (size_t i = 0; i < matches.x.size(); i += 5)
      matches.x_other[i] = {random.Unit() - 0.5, random.Unit() - 0.5};
  }
}

// The mean error of five draws with these neighbours, from 3 degrees off.
double MeanError(const std::vector<uint32_t>& neighbors, double arc_deg, bool misleads) {
  double sum = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const SyntheticScene scene = MakeScene(
        {.point_count = 1000, .noise_px = 0.5, .arc_deg = arc_deg, .planar = true, .seed = seed});
    Known known = KnownOf(scene, 0.2, neighbors);
    if (misleads) MisleadMatches(seed, &known.neighbors);
    const JointPose found =
        RefineJointly(OnTheArc(scene.poses[2], 3), known.x, known.points, known.neighbors, kScale);
    sum += CenterError(found.cam_from_world, scene) / 5;
  }
  return sum;
}

// The error of an epipolar line does not depend on the length of the baseline: a derivative that
// forgets it draws the photo to its neighbours.
TEST(JointPose, NeighboursDoNotDrawThePhoto) {
  EXPECT_LT(MeanError({1}, 40, true), 0.06);
  EXPECT_LT(MeanError({0, 1}, 40, true), 0.06);
  EXPECT_LT(MeanError({1, 3}, 10, false), 0.06);
}

// Otherwise the pose at a neighbour would be the cheapest.
TEST(JointPose, MatchesWithoutAnEpipolarLineCost) {
  const SyntheticScene scene = MakeScene({});
  Known known = KnownOf(scene, 1, {1});
  const double cost =
      RefineJointly(scene.poses[2], known.x, known.points, known.neighbors, kScale).cost;
  known.neighbors[0].cam_from_world = scene.poses[2];
  EXPECT_GT(RefineJointly(scene.poses[2], known.x, known.points, known.neighbors, kScale).cost,
            cost + 100);
}

TEST(JointPose, TheCostTellsWhatThePoseExplains) {
  const SyntheticScene scene = MakeScene({});
  Known known = KnownOf(scene, 1);
  const auto cost = [&](double degrees) {
    return RefineJointly(OnTheArc(scene.poses[2], degrees), known.x, known.points, known.neighbors,
                         kScale)
        .cost;
  };
  const double least = cost(0);
  EXPECT_NEAR(cost(2), least, 1e-3 * least);
  MisleadMatches(1, &known.neighbors);
  EXPECT_GT(cost(0), 2 * least);
}

}  // namespace
}  // namespace veduta
