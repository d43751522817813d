// SPDX-License-Identifier: Apache-2.0
// Goal: whether what a view sees says where it stands is told by one number, which depends on
//   what it sees alone; and by another one, in which the errors that are there count.
// Method: synthetic scenes, as they are, with other noise, enlarged, and seen through a narrow
//   part of one picture only.
#include "engine/mapping/pose_deviation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/mapping/growth.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

constexpr double kWhole = 1.0;

// All views, with points from what the first sees in the middle `part` of its picture's width.
CityMap MapOf(const SyntheticScene& scene, double part) {
  CityMap map;
  for (size_t k = 0; k < scene.images.size(); ++k) {
    MapImage image = scene.images[k];
    image.cam_from_world = scene.poses[k];
    image.points.assign(image.features->size(), PointId{});
    map.PlaceImage(std::move(image));
  }
  const auto is_inside = [&](FeatureIndex feature) {
    const double x = scene.images[0].features->keypoints[feature].x_px;
    return std::abs(x / SyntheticScene::kWidth - 0.5) < part / 2;
  };
  for (uint32_t j = 1; j < scene.images.size(); ++j) {
    PairRecord pair = scene.Pair(0, j);
    std::erase_if(pair.matches, [&](const FeatureMatch& match) { return !is_inside(match.a); });
    const PairMatches matches = MatchesFrom(pair, pair.b);
    GrowFromMatches(&map, pair.b, {&matches, 1}, GrowthOptions());
  }
  return map;
}

// The share of the first view.
double ShareOf(const SyntheticScene& scene, double part) {
  return DeviationShare(MapOf(scene, part), scene.images[0].id);
}

TEST(PoseDeviation, DoesNotDependOnTheNoiseOrTheUnit) {
  const double share = ShareOf(MakeScene({.noise_px = 0.3}), kWhole);
  EXPECT_GT(share, 1e-4);
  EXPECT_LT(share, 5e-3);
  EXPECT_NEAR(ShareOf(MakeScene({.noise_px = 0.6}), kWhole) / share, 1, 0.3);
  SyntheticScene large = MakeScene({.noise_px = 0.3});
  for (Rigid3& pose : large.poses) pose.translation *= 50;
  for (Eigen::Vector3d& point : large.points) point *= 50;
  EXPECT_NEAR(ShareOf(large, kWhole) / share, 1, 1e-3);
}

TEST(PoseDeviation, ANarrowViewSaysLittle) {
  const SyntheticScene scene = MakeScene({.point_count = 1000, .planar = true});
  EXPECT_GT(ShareOf(scene, 0.15), 5 * ShareOf(scene, kWhole));
}

TEST(PoseDeviation, IsInfiniteWhereNothingIsSeen) {
  EXPECT_TRUE(std::isinf(ShareOf(MakeScene({}), 0)));
  EXPECT_TRUE(std::isinf(DeviationShareInNetwork(MapOf(MakeScene({}), 0), ImageId(1), 5)));
}

TEST(PoseDeviation, PointsThatAreKnownSayMoreThanPointsThatAreSeen) {
  const SyntheticScene scene = MakeScene({.noise_px = 0.3});
  const double share = DeviationShare(scene.poses[0], scene.points);
  EXPECT_GT(share, 0.3 * ShareOf(scene, kWhole));
  EXPECT_LT(share, ShareOf(scene, kWhole));
  std::vector<Eigen::Vector3d> narrow;
  for (const Eigen::Vector3d& point : scene.points) narrow.push_back(0.1 * point);
  EXPECT_GT(DeviationShare(scene.poses[0], narrow), 5 * share);
}

TEST(PoseDeviation, TwoPointsDetermineNothing) {
  const SyntheticScene scene = MakeScene({});
  EXPECT_TRUE(std::isinf(DeviationShare(scene.poses[0], {scene.points.data(), 2})));
  EXPECT_TRUE(std::isinf(DeviationShare(scene.poses[0], {})));
  const std::vector<Eigen::Vector3d> on_the_axis(
      9, scene.poses[0].Inverse() * Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(std::isinf(DeviationShare(scene.poses[0], on_the_axis)));
  Rigid3 away = scene.poses[0];
  away.rotation = Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitY()) * away.rotation;
  away.translation = away.rotation * -scene.poses[0].Center();
  EXPECT_TRUE(std::isinf(DeviationShare(away, scene.points))) << "all of them behind";
}

TEST(PoseDeviation, InANetworkItGrowsWithTheNoise) {
  const double quiet = DeviationShareInNetwork(MapOf(MakeScene({.noise_px = 0.2}), kWhole),
                                               ImageId(1), 5),
               noisy = DeviationShareInNetwork(MapOf(MakeScene({.noise_px = 0.6}), kWhole),
                                               ImageId(1), 5);
  EXPECT_GT(quiet, 0);
  EXPECT_NEAR(noisy / quiet, 3, 1);
}

}  // namespace
}  // namespace veduta
