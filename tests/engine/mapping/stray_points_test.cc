// SPDX-License-Identifier: Apache-2.0
// Goal: points of two views beyond the surface around them, or before it, are removed, and no
//   others.
// Method: a synthetic map of a plane at the truth. Some of its points are seen by two images alone
//   and are moved towards one of them or away from it.
#include "engine/mapping/stray_points.h"

#include <gtest/gtest.h>

#include <limits>

#include "synthetic_scene.h"

namespace veduta {
namespace {

class StrayPoints : public testing::Test {
 protected:
  StrayPoints() : scene_(MakeScene({.point_count = 2000, .planar = true})), map_(MakeMap(scene_)) {
    for (const auto& [id, image] : map_.images()) images_.push_back(id);
    for (const PointId id : map_.PointsSeenBy({images_.data(), 1})) {
      if (map_.point(id).track.size() >= 3) seen_.push_back(id);
    }
  }

  // Leaves it the first two of its views.
  void LeaveTwoViews(PointId id) {
    const std::vector<TrackElement> track = map_.point(id).track;
    for (size_t i = 2; i < track.size(); ++i) map_.RemoveObservation(id, track[i].image);
  }
  // So many times as far from the first image that sees it.
  void Move(PointId id, double factor) {
    const Eigen::Vector3d center =
        map_.image(map_.point(id).track.front().image).cam_from_world.Center();
    map_.SetPosition(id, center + factor * (map_.point(id).position - center));
  }
  uint32_t Remove(const StrayOptions& options = {}, size_t threads = 1) {
    ThreadPool pool(threads);
    return RemoveStrayPoints(&map_, images_, options, &pool);
  }

  const SyntheticScene scene_;
  CityMap map_;
  std::vector<ImageId> images_;
  std::vector<PointId> seen_;  // by the first image and two others or more
};

TEST_F(StrayPoints, BeyondAWallAndBeforeItTheyGo) {
  ASSERT_GE(seen_.size(), 200u);
  const PointId beyond = seen_[50], before = seen_[100], on_it = seen_[150];
  for (const PointId id : {beyond, before, on_it}) LeaveTwoViews(id);
  Move(beyond, 1.6);
  Move(before, 0.6);
  EXPECT_EQ(Remove({}, 2), 2u);
  EXPECT_EQ(map_.FindPoint(beyond), nullptr);
  EXPECT_EQ(map_.FindPoint(before), nullptr);
  EXPECT_NE(map_.FindPoint(on_it), nullptr);
  EXPECT_EQ(Remove(), 0u);
}

TEST_F(StrayPoints, WhatAThirdViewSeesStays) {
  Move(seen_[50], 1.6);
  EXPECT_EQ(Remove(), 0u);
}

TEST_F(StrayPoints, WhereTooLittleIsAroundNobodyKnows) {
  LeaveTwoViews(seen_[50]);
  Move(seen_[50], 1.6);
  EXPECT_EQ(Remove({.radius_share = 1e-3}), 0u);
  EXPECT_EQ(Remove({.surrounding_min = 5000}), 0u);
  EXPECT_EQ(Remove({.depth_share_max = 0.8}), 0u);
  EXPECT_EQ(Remove(), 1u);
}

TEST_F(StrayPoints, BothImagesMustBeAsked) {
  LeaveTwoViews(seen_[50]);
  Move(seen_[50], 1.6);
  ThreadPool pool(1);
  EXPECT_EQ(RemoveStrayPoints(&map_, {images_.data(), 1}, {}, &pool), 0u);
}

TEST_F(StrayPoints, WhatIsStoredBesideThePictureIsHarmless) {
  auto moved = std::make_shared<Features>(*map_.image(images_[0]).features);
  moved->keypoints[0].x_px = -1e9F;
  moved->keypoints[1].x_px = moved->keypoints[1].y_px = 1e9F;
  moved->keypoints[2].y_px = std::numeric_limits<float>::quiet_NaN();
  MapImage image = map_.image(images_[0]);
  image.features = moved;
  map_.LoadImage(image);
  LeaveTwoViews(seen_[50]);
  Move(seen_[50], 1.6);
  EXPECT_EQ(Remove(), 1u);
  EXPECT_EQ(Remove({.radius_share = 1e-9}), 0u);
}

TEST_F(StrayPoints, OptionsOutOfBoundsAreNamed) {
  EXPECT_TRUE(StrayOptions().Check().ok());
  EXPECT_NE(StrayOptions{.radius_share = 2}.Check().message().find("radius_share"),
            std::string::npos);
}

}  // namespace
}  // namespace veduta
