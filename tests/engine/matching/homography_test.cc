// SPDX-License-Identifier: Apache-2.0
// Goal: the plane that most matches lie on is found among others, and nothing where there is none.
// Method: points of a known homography among random ones.
#include "engine/matching/homography.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

struct Matches {
  std::vector<Eigen::Vector2d> a, b;
};

Eigen::Matrix3d SomePlane() {
  Eigen::Matrix3d plane;
  plane << 1.1, 0.05, 0.2, -0.04, 0.95, -0.1, 0.15, 0.02, 1;
  return plane;
}

// The first `on_plane` lie on the plane, the others anywhere.
Matches MakeMatches(int on_plane, int others) {
  SeededRandom random(3);
  Matches matches;
  for (int i = 0; i < on_plane + others; ++i) {
    const Eigen::Vector2d a{random.Unit() - 0.5, random.Unit() - 0.5};
    const Eigen::Vector3d p = SomePlane() * Eigen::Vector3d(a.x(), a.y(), 1);
    matches.a.push_back(a);
    matches.b.push_back(i < on_plane ? Eigen::Vector2d(p.head<2>() / p.z())
                                     : Eigen::Vector2d{random.Unit() - 0.5, random.Unit() - 0.5});
  }
  return matches;
}

TEST(FindHomography, FindsThePlaneAmongOtherMatches) {
  const Matches matches = MakeMatches(60, 90);
  const Homography found = FindHomography(matches.a, matches.b, 1e-3, 400, 1);
  EXPECT_GE(found.inlier_count, 60u);
  EXPECT_LE(found.inlier_count, 63u);
  EXPECT_LT((found.b_from_a - SomePlane()).norm(), 1e-6);
  for (int i = 0; i < 60; ++i) EXPECT_TRUE(found.Explains(matches.a[i], matches.b[i], 1e-3));
}

TEST(FindHomography, BehindTheCameraNothingIsExplained) {
  Homography behind;
  behind.b_from_a << 1, 0, 0, 0, 1, 0, 1, 0, 1;
  EXPECT_TRUE(behind.Explains({-0.5, 0}, {-1, 0}, 1e-9));
  EXPECT_FALSE(behind.Explains({-2, 0}, {2, 0}, 1e-9));  // at a depth of -1
}

TEST(FindHomography, ThreeMatchesAndThoseOfOnePlaceHaveNone) {
  const Matches matches = MakeMatches(3, 0);
  EXPECT_EQ(FindHomography(matches.a, matches.b, 1e-3, 60, 1).inlier_count, 0u);
  const std::vector<Eigen::Vector2d> same(8, Eigen::Vector2d(0.1, 0.2));
  EXPECT_EQ(FindHomography(same, same, 1e-3, 60, 1).inlier_count, 0u);
}

}  // namespace
}  // namespace veduta
