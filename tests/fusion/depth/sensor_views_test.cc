// SPDX-License-Identifier: Apache-2.0
// Goal: the views that stereo is computed from are those of equations 7 and 8: enough overlap,
//   a good angle, sky not counted.
// Method: a wall of points seen by cameras at chosen distances beside the key view, where
//   overlap and angle are known; each rule broken once.
#include "fusion/depth/sensor_views.h"

#include <gtest/gtest.h>

#include <cmath>

namespace veduta {
namespace {

constexpr double kFocalPx = 500, kDepth = 10;
const ImageId kKey(1), kNear(2), kGood(3), kFar(4), kOther(5);

// A wall at depth 10 across the lower half of the image, points every 20 px; the upper half is sky.
struct Wall {
  KeyView key;
  std::vector<std::vector<ImageId>> tracks;

  // `seen_by` tells which images see the point at a pixel.
  template <typename SeenBy>
  explicit Wall(SeenBy&& seen_by) {
    key.width_px = 640, key.height_px = 480;
    key.center = Eigen::Vector3d::Zero();
    for (double y = 250; y < 480; y += 20) {
      for (double x = 10; x < 640; x += 20) {
        key.features.emplace_back(x, y);
        tracks.push_back(seen_by(Eigen::Vector2d(x, y)));
      }
    }
    for (size_t i = 0; i < key.features.size(); ++i) {
      const Eigen::Vector2d& x = key.features[i];
      key.points.push_back(
          {x,
           {(x.x() - 320) / kFocalPx * kDepth, (x.y() - 240) / kFocalPx * kDepth, kDepth},
           tracks[i]});
    }
  }
};

// Beside the key view, so that the middle of the wall is seen under this angle.
Eigen::Vector3d At(double angle_deg) {
  return {kDepth * std::tan(angle_deg * M_PI / 180), 0, 0};
}

TEST(SensorViews, PreferenceIsGreatestAtItsAngle) {
  EXPECT_EQ(AnglePreference(0, 6), 0);
  for (const double angle : {0.5, 2.0, 5.0, 7.0, 12.0, 40.0})
    EXPECT_LT(AnglePreference(angle, 6), AnglePreference(6, 6));
  EXPECT_DOUBLE_EQ(AnglePreference(3, 6), 9 * std::exp(-1));
}

TEST(SensorViews, BestAngleComesFirst) {
  const Wall wall([](const Eigen::Vector2d&) { return std::vector{kKey, kNear, kGood, kFar}; });
  const auto views =
      RankSensorViews(wall.key, {{kNear, At(1)}, {kGood, At(6)}, {kFar, At(25)}}, {});
  ASSERT_TRUE(views.ok());
  ASSERT_EQ(views->size(), 3u);
  EXPECT_EQ((*views)[0].image, kGood);
  EXPECT_NEAR((*views)[0].angle_median_deg, 6, 1) << "less towards the sides of the wall";
  EXPECT_EQ((*views)[0].point_count, wall.key.points.size());
  // All of the wall but its fringe of cells, and the sky above it is not counted against them: that
  // would be half.
  for (const SensorView& view : *views) EXPECT_GT(view.overlap, 0.8);
  EXPECT_NEAR((*views)[0].score,
              (*views)[0].overlap * AnglePreference((*views)[0].angle_median_deg, 6), 0.05);
}

TEST(SensorViews, SmallOverlapIsNoSensorView) {
  const Wall wall([](const Eigen::Vector2d& x) {
    std::vector<ImageId> track = {kKey, kGood};
    if (x.x() < 640 * 0.2) track.push_back(kFar);    // a fifth of the wall
    if (x.x() < 640 * 0.5) track.push_back(kOther);  // half of it
    return track;
  });
  const auto views =
      RankSensorViews(wall.key, {{kGood, At(6)}, {kFar, At(6)}, {kOther, At(6)}}, {});
  ASSERT_TRUE(views.ok());
  ASSERT_EQ(views->size(), 2u);
  EXPECT_EQ((*views)[0].image, kGood);
  EXPECT_EQ((*views)[1].image, kOther);
  EXPECT_NEAR((*views)[1].overlap / (*views)[0].overlap, 0.5, 0.04);
}

TEST(SensorViews, WithoutPoseOrParallaxOrPointsThereIsNoView) {
  const Wall wall([](const Eigen::Vector2d&) { return std::vector{kKey, kNear, kGood}; });
  EXPECT_TRUE(RankSensorViews(wall.key, {}, {})->empty());
  EXPECT_TRUE(RankSensorViews(wall.key, {{kKey, wall.key.center}}, {})->empty())
      << "the key view itself";
  KeyView poor = wall.key;
  poor.points.resize(5);
  EXPECT_TRUE(RankSensorViews(poor, {{kGood, At(6)}}, {})->empty());
}

TEST(SensorViews, RefusesWhatMakesNoSense) {
  const Wall wall([](const Eigen::Vector2d&) { return std::vector{kKey, kGood}; });
  const auto refused = [&](auto change) {
    SensorViewOptions options;
    change(options);
    return RankSensorViews(wall.key, {}, options).status().code() == StatusCode::kInvalidArgument;
  };
  EXPECT_TRUE(refused([](auto& o) { o.overlap_min = 1.5; }));
  EXPECT_TRUE(refused([](auto& o) { o.angle_best_deg = 0; }));
  EXPECT_TRUE(refused([](auto& o) { o.point_count_min = 2; }));
  EXPECT_TRUE(refused([](auto& o) { o.cells_across = 1; }));
  EXPECT_TRUE(refused([](auto& o) { o.cell_feature_count_min = 0; }));
  KeyView empty;
  EXPECT_EQ(RankSensorViews(empty, {}, {}).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
