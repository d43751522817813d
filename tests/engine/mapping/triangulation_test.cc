// SPDX-License-Identifier: Apache-2.0
// Goal: triangulation returns the truth and refuses what is degenerate; angles and errors are as
//   defined.
// Method: a synthetic scene of known truth without noise.
#include "engine/mapping/triangulation.h"

#include <gtest/gtest.h>

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

TEST(Triangulation, NearestDirectionIsTheFirstOfTheSmallestAngle) {
  SeededRandom random(3);
  const auto draw = [&] {
    return Eigen::Vector3d{random.Unit(), random.Unit(), random.Unit() - 0.5};
  };
  for (int round = 0; round < 500; ++round) {
    const Eigen::Vector3d center = draw(), point = 5 * draw();
    std::vector<Eigen::Vector3d> places;
    for (int i = 0; i < 12; ++i) {
      places.push_back(i % 4 == 3 ? places[random.Below(i)] : draw());      // some twice
      if (i % 5 == 4) places.back() = point + 3 * (places[i - 2] - point);  // some on one ray
    }
    size_t best = 0;
    for (size_t i = 1; i < places.size(); ++i) {
      if (RayAngleDeg(places[i], center, point) < RayAngleDeg(places[best], center, point))
        best = i;
    }
    NearestDirection nearest(center, point);
    size_t found = places.size();
    for (size_t i = 0; i < places.size(); ++i) {
      if (nearest.IsNearer(places[i])) found = i;
    }
    EXPECT_EQ(found, best);
    EXPECT_EQ(nearest.angle_deg(), RayAngleDeg(places[best], center, point));
  }
  EXPECT_TRUE(std::isinf(NearestDirection({0, 0, 0}, {0, 0, 1}).angle_deg()));
}

TEST(Triangulation, MeasuresAnglesAndErrors) {
  EXPECT_NEAR(RayAngleDeg({-1, 0, 0}, {1, 0, 0}, {0, 0, 1}), 90, 1e-9);
  EXPECT_NEAR(RayAngleDeg({0, 0, 0}, {0, 0, 0}, {0, 0, 1}), 0, 1e-9);
  const SyntheticScene scene = MakeScene({.noise_px = 0});
  const uint32_t point = scene.seen[0][0];
  std::vector<Sighting> views;
  for (uint32_t k = 0; k < scene.images.size(); ++k) {
    const int feature = scene.feature_of[k][point];
    if (feature >= 0) views.push_back(scene.images[k].ViewOf(static_cast<FeatureIndex>(feature)));
  }
  ASSERT_GE(views.size(), 3u);
  // The largest of all angles is that between the ends of the arc.
  const double ends = RayAngleDeg(views.front().cam_from_world.Center(),
                                  views.back().cam_from_world.Center(), scene.points[point]);
  EXPECT_NEAR(TriangulationAngleDeg(views, scene.points[point]), ends, 1e-9);
  EXPECT_LT(ReprojectionErrorPx(views[0], scene.points[point]), 1e-3);
  views[0].x_px += Eigen::Vector2d(3, 4);
  EXPECT_NEAR(ReprojectionErrorPx(views[0], scene.points[point]), 5, 1e-3);
  const Eigen::Vector3d behind = views[0].cam_from_world.Inverse() * Eigen::Vector3d(0, 0, -1);
  EXPECT_TRUE(std::isinf(ReprojectionErrorPx(views[0], behind)));
}

}  // namespace
}  // namespace veduta
