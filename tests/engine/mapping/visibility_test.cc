// SPDX-License-Identifier: Apache-2.0
// Goal: a view at its right pose finds what other images see there; one at a wrong pose lacks it;
//   points of which nobody can say that the view must see them are not asked.
// Method: a synthetic scene whose points have descriptors of their own, seen by a view that is in
//   the map or not, at its true pose and at others.
#include "engine/mapping/visibility.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

constexpr SceneOptions kDense{.camera_count = 6, .point_count = 2000};

// A map of these cameras alone.
CityMap MapOf(const SyntheticScene& scene, const std::vector<uint32_t>& cameras) {
  CityMap map;
  for (const uint32_t k : cameras) map.PlaceImage(scene.images[k]);
  for (uint32_t i = 0; i < scene.points.size(); ++i) {
    std::vector<TrackElement> track;
    for (const uint32_t k : cameras) {
      if (scene.feature_of[k][i] >= 0)
        track.push_back({scene.images[k].id, static_cast<FeatureIndex>(scene.feature_of[k][i])});
    }
    if (track.size() >= 2) map.AddPoint(track.front().image, scene.points[i], track);
  }
  return map;
}

std::vector<PointId> AllPoints(const CityMap& map) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  return map.PointsSeenBy(ids);
}

VisibleStructure Visible(const CityMap& map, const MapImage& view,
                         const VisibilityOptions& options = {}) {
  return FindVisible(map, view, {}, AllPoints(map), options);
}

// The view's center moves by this, in the world.
MapImage Moved(MapImage view, const Eigen::Vector3d& by) {
  view.cam_from_world.translation -= view.cam_from_world.rotation * by;
  return view;
}

TEST(Visibility, TheRightPoseFindsWhatOthersSee) {
  const SyntheticScene scene = MakeScene(kDense);
  const CityMap map = MapOf(scene, {0, 1, 3, 4, 5});
  const VisibleStructure visible = Visible(map, scene.images[2]);
  EXPECT_GT(visible.expected, 1000u);
  EXPECT_GT(visible.found, 0.99 * visible.expected);
  EXPECT_GT(visible.cells, 30u);
  EXPECT_EQ(visible.missing_cells, 0u);
  EXPECT_EQ(visible.missing_share(), 0);
}

TEST(Visibility, AShiftedPoseLacksIt) {
  const SyntheticScene scene = MakeScene(kDense);
  const CityMap map = MapOf(scene, {0, 1, 3, 4, 5});
  const VisibleStructure visible = Visible(map, Moved(scene.images[2], {0.5, 0, 0}));
  EXPECT_GT(visible.expected, 500u);
  EXPECT_LT(visible.found, 0.05 * visible.expected);
  EXPECT_GT(visible.cells, 20u);
  EXPECT_GT(visible.missing_share(), 0.9);
}

TEST(Visibility, WhatTheViewObservesIsFound) {
  const SyntheticScene scene = MakeScene(kDense);
  CityMap map = MakeMap(scene);
  // Its features look like nothing that is known any more.
  MapImage view = map.image(ImageId(3));
  auto features = std::make_shared<Features>(*view.features);
  for (uint8_t& byte : features->descriptors) byte = 255;
  view.features = features;
  EXPECT_EQ(Visible(map, view).found, Visible(map, view).expected);
  EXPECT_GT(Visible(map, view).expected, 1000u);
}

TEST(Visibility, PointsOfOneOtherImageAreNotAsked) {
  const SyntheticScene scene = MakeScene(kDense);
  EXPECT_EQ(Visible(MapOf(scene, {1, 2}), scene.images[2]).expected, 0u);
  EXPECT_GT(Visible(MapOf(scene, {1, 3, 2}), scene.images[2]).expected, 1000u);
}

TEST(Visibility, OnlyImagesThatLookAlikeAreBelieved) {
  const SyntheticScene scene = MakeScene(kDense);
  const CityMap map = MapOf(scene, {0, 1});
  // 8 degrees from the nearest of the two, and 24 and more.
  EXPECT_GT(Visible(map, scene.images[2]).expected, 500u);
  EXPECT_EQ(Visible(map, scene.images[5]).expected, 0u);
  EXPECT_GT(Visible(map, scene.images[5], {.angle_deg_max = 60}).expected, 500u);
  // Twice as far away.
  const MapImage behind = Moved(scene.images[2], scene.poses[2].Center());
  EXPECT_EQ(Visible(map, behind).expected, 0u);
  EXPECT_GT(Visible(map, behind, {.distance_ratio_max = 3}).expected, 500u);
}

TEST(Visibility, NothingIsExpectedBehindTheViewOrBesideThePicture) {
  const SyntheticScene scene = MakeScene(kDense);
  const CityMap map = MapOf(scene, {0, 1, 3});
  MapImage view = scene.images[2];
  view.cam_from_world =
      Rigid3{Eigen::Quaterniond(Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitY())),
             Eigen::Vector3d::Zero()} *
      view.cam_from_world;
  EXPECT_EQ(Visible(map, view).expected, 0u);
  const VisibleStructure none = FindVisible(map, scene.images[2], {}, {}, {});
  EXPECT_EQ(none.expected + none.cells, 0u);
  EXPECT_EQ(none.missing_share(), 0);
}

TEST(Visibility, NothingIsExpectedBehindWhatTheViewSees) {
  const SyntheticScene scene = MakeScene(kDense);
  const CityMap map = MapOf(scene, {0, 1, 3});
  const MapImage& view = scene.images[2];
  const std::vector<PointId> points = AllPoints(map);
  const uint32_t expected = FindVisible(map, view, {}, points, {}).expected;
  ASSERT_GT(expected, 500u);
  // A wall all over the picture, before, amid and behind the points; and one on its left half.
  const auto wall = [&](double depth, double width, const VisibilityOptions& options = {}) {
    std::vector<SeenDepth> seen;
    for (double y = 2; y < view.height_px; y += 8) {
      for (double x = 2; x < width * view.width_px; x += 8) seen.push_back({{x, y}, depth});
    }
    return FindVisible(map, view, seen, points, options).expected;
  };
  double nearest = 1e9, farthest = 0;
  for (const PointId id : points) {
    const double depth = (view.cam_from_world * map.point(id).position).z();
    nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
  }
  EXPECT_EQ(wall(nearest / 1.3, 1), 0u);
  EXPECT_EQ(wall(farthest, 1), expected);
  // What is near by tells of a part of the picture where the view sees nothing, if it is looked for
  // so far away; two points do not.
  const VisibilityOptions far{.hidden_reach_cells = 32};
  EXPECT_EQ(wall(nearest / 1.3, 0.5, far), 0u);
  EXPECT_GT(wall(nearest / 1.3, 0.5), 0.3 * expected);
  std::vector<SeenDepth> left, right;
  for (const double y : {100.0, 101.0, 102.0}) {
    left.push_back({{100, y}, nearest / 1.3});
    right.push_back({{view.width_px - 100.0, y}, farthest});
  }
  std::vector<SeenDepth> both = left;
  both.insert(both.end(), right.begin(), right.end());
  const uint32_t beside = FindVisible(map, view, both, points, far).expected;
  EXPECT_GT(beside, 0.3 * expected);
  EXPECT_LT(beside, 0.7 * expected);
  left.pop_back();
  EXPECT_EQ(FindVisible(map, view, left, points, far).expected, expected);
}

TEST(Visibility, WhatAnImageSeesIsListedWithItsDepth) {
  const SyntheticScene scene = MakeScene(kDense);
  const CityMap map = MakeMap(scene);
  const MapImage& image = map.image(scene.images[2].id);
  const std::vector<SeenDepth> seen = ListSeenDepths(map, image);
  ASSERT_GT(seen.size(), 500u);
  size_t i = 0;
  for (FeatureIndex feature = 0; feature < image.points.size(); ++feature) {
    if (!image.points[feature].valid()) continue;
    const Eigen::Vector3d x_cam = image.cam_from_world * map.point(image.points[feature]).position;
    EXPECT_NEAR(seen[i].depth, x_cam.z(), 1e-9);
    EXPECT_LT((image.camera.Project(x_cam) - seen[i].x_px).norm(), 5.0);
    ++i;
  }
  EXPECT_EQ(i, seen.size());
}

TEST(Visibility, CellsNeedPoints) {
  const SyntheticScene scene = MakeScene(kDense);
  const CityMap map = MapOf(scene, {0, 1, 3});
  const MapImage wrong = Moved(scene.images[2], {0.5, 0, 0});
  EXPECT_EQ(Visible(map, wrong, {.cell_points_min = 100'000}).cells, 0u);
  const VisibleStructure one = Visible(map, wrong, {.cells_each_way = 1});
  EXPECT_EQ(one.cells, 1u);
  EXPECT_EQ(one.missing_cells, 1u);
  EXPECT_EQ(Visible(map, wrong, {.cell_found_share_min = 0}).missing_cells, 0u);
}

TEST(Visibility, RefusesWhatIsOutOfBounds) {
  using O = VisibilityOptions;
  ExpectBounds(&O::angle_deg_max, "angle_deg_max", {0.0, 90.0}, {1.0, 89.0});
  ExpectBounds(&O::distance_ratio_max, "distance_ratio_max", {1.0, 0.5}, {1.01, 10.0});
  ExpectBounds(&O::search_radius_px, "search_radius_px", {0.0, -1.0}, {0.1, 100.0});
  ExpectBounds(&O::descriptor_distance_squared_max, "descriptor_distance_squared_max", {0u}, {1u});
  ExpectBounds(&O::cells_each_way, "cells_each_way", {0u}, {1u, 16u});
  ExpectBounds(&O::cell_points_min, "cell_points_min", {0u}, {1u});
  ExpectBounds(&O::cell_found_share_min, "cell_found_share_min", {-0.1, 1.1}, {0.0, 1.0});
  ExpectBounds(&O::depth_cells_each_way, "depth_cells_each_way", {0u}, {1u, 64u});
  ExpectBounds(&O::hidden_reach_cells, "hidden_reach_cells", {0u}, {1u, 64u});
  ExpectBounds(&O::hidden_depth_ratio_min, "hidden_depth_ratio_min", {1.0, 0.5}, {1.01, 10.0});
}

}  // namespace
}  // namespace veduta
