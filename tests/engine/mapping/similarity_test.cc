// SPDX-License-Identifier: Apache-2.0
// Goal: a similarity is found exactly and among outliers, and refused where points do not determine
//   it.
// Method: points carried over by a known similarity, a third of them replaced.
#include "engine/mapping/similarity.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

TEST(Similarity, IsExactAndRobust) {
  const Sim3 b_from_a{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized())),
      {1, -2, 3}};
  SeededRandom random(2);
  std::vector<Eigen::Vector3d> a, b;
  for (int i = 0; i < 60; ++i) {
    a.push_back({random.Unit(), random.Unit(), random.Unit()});
    b.push_back(i % 3 ? b_from_a * a.back()
                      : Eigen::Vector3d{9 * random.Unit(), 9 * random.Unit(), 9 * random.Unit()});
  }
  const auto near = [&](const Sim3& fit, size_t i) { return (fit * a[i] - b[i]).norm() < 0.01; };
  const auto found = EstimateSimilarity(a, b, near, 20, 7);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->inliers.size(), 40u);
  EXPECT_NEAR(found->b_from_a.scale, 2.5, 1e-9);
  EXPECT_LT((found->b_from_a.translation - b_from_a.translation).norm(), 1e-9);
  EXPECT_FALSE(EstimateSimilarity(a, b, near, 41, 7).has_value());
}

// A similarity to be found.
Sim3 ATurn() {
  return {2.5,
          Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())),
          {1, -2, 3}};
}

// What the cameras of `poses` see of the scene's points, the points and the cameras each carried to
// a frame of their own; every fifth is another point's.
std::vector<CrossSighting> Sightings(const SyntheticScene& scene, std::span<const Rigid3> poses,
                                     const Sim3& cameras, const Sim3& points) {
  std::vector<CrossSighting> seen;
  for (const Rigid3& pose : poses) {
    for (size_t i = 0; i < 60; ++i) {
      const Eigen::Vector3d x_cam = pose * scene.points[i];
      const Eigen::Vector3d& shown = scene.points[i % 5 ? i : i + 100];
      seen.push_back(
          {{}, TransformCameraWorld(cameras, pose), x_cam.hnormalized(), points * shown});
    }
  }
  return seen;
}

TEST(Similarity, IsRefinedByWhatIsSeenAcross) {
  const SyntheticScene scene = MakeScene({});
  const Sim3 b_from_a = ATurn();
  const std::span<const Rigid3> poses(scene.poses);
  const auto in_b = Sightings(scene, poses.first(2), b_from_a, {}),
             in_a = Sightings(scene, poses.subspan(2, 2), {}, b_from_a);
  const Sim3 about = Sim3{1.01,
                          Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())),
                          {0.02, -0.03, 0.01}} *
                     b_from_a;
  const auto expect_right = [&](const Sim3& found) {
    EXPECT_NEAR(found.scale, b_from_a.scale, 1e-3);
    EXPECT_LT(found.rotation.angularDistance(b_from_a.rotation), 1e-3);
    EXPECT_LT((found.translation - b_from_a.translation).norm(), 5e-3);
  };
  expect_right(RefineSimilarity(about, in_b, in_a, 2.0));
  expect_right(RefineSimilarity(about, in_b, {}, 2.0));
  expect_right(RefineSimilarity(about, {}, in_a, 2.0));
  EXPECT_EQ(RefineSimilarity(about, {}, {}, 2.0).scale, about.scale);
}

TEST(Similarity, TheCovarianceIsThatOfNoisySightings) {
  const SyntheticScene scene = MakeScene({});
  const Sim3 b_from_a = ATurn();
  const std::span<const Rigid3> poses(scene.poses);
  auto in_b = Sightings(scene, poses.first(2), b_from_a, {}),
       in_a = Sightings(scene, poses.subspan(2, 2), {}, b_from_a);
  for (auto [seen, to_camera] : {std::pair(&in_b, b_from_a), {&in_a, b_from_a.Inverse()}}) {
    std::erase_if(*seen, [&, carry = to_camera](const CrossSighting& one) {
      return ((one.cam_from_world * (carry * one.point)).hnormalized() - one.x).norm() > 0.01;
    });
    ASSERT_EQ(seen->size(), 96u) << "all but every fifth";
  }
  constexpr double kNoLoss = 1e6;
  const SimilarityCovariance covariance = CovarianceOf(b_from_a, in_b, in_a, kNoLoss);
  const Eigen::Vector3d place(3, -4, 5);
  SeededRandom random(1);
  const auto shaken = [&](std::vector<CrossSighting> seen) {
    for (CrossSighting& one : seen)
      one.x += Eigen::Vector2d{Gaussian(random), Gaussian(random)} / one.focal_px;
    return seen;
  };
  constexpr int kDraws = 400;
  double squared = 0, log_scale_squared = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Sim3 found = RefineSimilarity(b_from_a, shaken(in_b), shaken(in_a), kNoLoss);
    squared += (found * place - b_from_a * place).squaredNorm() / kDraws;
    log_scale_squared += std::pow(std::log(found.scale / b_from_a.scale), 2) / kDraws;
  }
  EXPECT_NEAR(std::sqrt(squared) / covariance.PositionDeviation(b_from_a * place), 1, 0.1);
  EXPECT_NEAR(std::sqrt(log_scale_squared) / covariance.LogScaleDeviation(), 1, 0.1);
  const SimilarityCovariance unknown = CovarianceOf(b_from_a, {}, {}, kNoLoss);
  EXPECT_FALSE(unknown.LogScaleDeviation() < 1);
  EXPECT_FALSE(unknown.PositionDeviation(place) < 1);
}

TEST(Similarity, RefusesALine) {
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 0, 0);
  EXPECT_FALSE(FitSimilarity(line, line).has_value());
}

TEST(Similarity, ACameraFollowsItsWorld) {
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
