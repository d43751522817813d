// SPDX-License-Identifier: Apache-2.0
// Goal: a body is placed where what is seen across agrees, near by and far away, or near by where
//   it fits clearly better; where as much agrees with where it stands, or too little with anything,
//   it stays.
// Method: a synthetic scene; half of its cameras and points are the body, which is carried away.
#include "engine/mapping/body_place.h"

#include <gtest/gtest.h>

#include "tests/engine/mapping/synthetic_scene.h"

namespace veduta {
namespace {

struct Across {
  std::vector<CrossSighting> in_rest, in_body;
};

// The body is all cameras from the fourth on, and every second point. Every `wrong`-th sighting is
// of another point.
Across See(const SyntheticScene& scene, const Sim3& away, size_t wrong) {
  Across across;
  for (uint32_t camera = 0; camera < scene.poses.size(); ++camera) {
    const bool is_body = camera >= 3;
    for (size_t i = is_body; i + 70 < scene.points.size(); i += 2) {
      const Eigen::Vector3d x_cam = scene.poses[camera] * scene.points[i];
      const Eigen::Vector3d& known = scene.points[i % wrong < 2 ? i + 70 : i];
      (is_body ? across.in_body : across.in_rest)
          .push_back(
              {ImageId(camera + 1),
               is_body ? TransformCameraWorld(away, scene.poses[camera]) : scene.poses[camera],
               x_cam.hnormalized(), is_body ? known : away * known});
    }
  }
  return across;
}

Sim3 Away(double turn_rad) {
  return {1.1,
          Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY())),
          {turn_rad, 0.1, -2 * turn_rad}};
}

TEST(BodyPlace, IsFoundNearByAndFarAway) {
  const SyntheticScene scene = MakeScene({.camera_count = 6});
  for (const double turn_rad : {0.01, 0.2, 1.0}) {
    SCOPED_TRACE("turned by " + std::to_string(turn_rad));
    const Across across = See(scene, Away(turn_rad), 6);
    const auto found = FindBodyPlace(across.in_rest, across.in_body, 1);
    ASSERT_TRUE(found.has_value());
    const Sim3 back = found->new_from_old * Away(turn_rad);
    EXPECT_NEAR(found->share, 2.0 / 3, 0.05);
    EXPECT_NEAR(back.scale, 1, 1e-3);
    EXPECT_LT(back.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-3);
    EXPECT_LT(back.translation.norm(), 5e-3);
    EXPECT_EQ(FindBodyPlace(across.in_rest, across.in_body, 1)->new_from_old.translation,
              found->new_from_old.translation);
  }
}

TEST(BodyPlace, IsFoundWhereAllFitsClearlyBetterThoughNoMoreAgrees) {
  const Sim3 away{1, Eigen::Quaterniond::Identity(), {0.004, 0, 0}};  // half a pixel
  const SyntheticScene many = MakeScene({.camera_count = 6, .point_count = 2000});
  const Across across = See(many, away, 6);
  const auto found = FindBodyPlace(across.in_rest, across.in_body, 1);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->share, 2.0 / 3, 0.05);
  EXPECT_LT((found->new_from_old * away).translation.norm(), 1e-3);
  const Sim3 less{1, Eigen::Quaterniond::Identity(), {0.0015, 0, 0}};
  const Across close = See(many, less, 6);
  EXPECT_FALSE(FindBodyPlace(close.in_rest, close.in_body, 1).has_value());
}

TEST(BodyPlace, StaysWhereItStandsRightAndWhereNothingAgrees) {
  const SyntheticScene scene = MakeScene({.camera_count = 6});
  const Across right = See(scene, {}, 6), nonsense = See(scene, Away(0.5), 2);
  EXPECT_FALSE(FindBodyPlace(right.in_rest, right.in_body, 1).has_value());
  EXPECT_FALSE(FindBodyPlace(nonsense.in_rest, nonsense.in_body, 1).has_value());
  EXPECT_FALSE(FindBodyPlace({}, {}, 1).has_value());
}

}  // namespace
}  // namespace veduta
