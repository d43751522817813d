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
