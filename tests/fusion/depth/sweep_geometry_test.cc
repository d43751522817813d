// SPDX-License-Identifier: Apache-2.0
// Goal: where a key view's pixel lies in a sensor view, how fast it moves there with its inverse
//   depth, and planes that are as far apart as asked for; a view at half its size sees the same.
// Method: points projected by the cameras themselves; two cameras side by side, whose motion is
//   focal length times baseline; halved views compared with the whole at the same rays.
#include "fusion/depth/sweep_geometry.h"

#include <gtest/gtest.h>

#include "fusion/depth/view_pyramid.h"

namespace veduta {
namespace {

ViewGeometry CameraAt(double x) {
  ViewGeometry geometry;
  geometry.width_px = 80, geometry.height_px = 60;
  geometry.camera.fx = 70, geometry.camera.fy = 72;
  geometry.camera.cx = 38, geometry.camera.cy = 31;
  geometry.cam_from_world.translation = {-x, 0, 0};
  return geometry;
}

TEST(SweepGeometry, LeadsToWhereThePointIsSeen) {
  const ViewGeometry key = CameraAt(0);
  ViewGeometry sensor = CameraAt(0.4);
  sensor.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.2, 1, 0.1).normalized()));
  const SweepGeometry sweep(key, sensor);
  for (const double depth : {1.5, 4.0, 30.0}) {
    const Eigen::Vector2d x_px(20, 45);
    const Eigen::Vector3d in_key = depth * key.camera.Normalize(x_px).homogeneous();
    const Eigen::Vector3d world = key.cam_from_world.Inverse() * in_key;
    const Eigen::Vector2d expected = sensor.camera.Project(sensor.cam_from_world * world);
    const Eigen::Vector2d seen = sweep.Ray(x_px.x(), x_px.y(), 1 / depth).hnormalized();
    EXPECT_NEAR((seen - expected).norm(), 0, 1e-9) << depth;
  }
}

TEST(SweepGeometry, SpeedIsFocalLengthTimesBaselineSideBySide) {
  const ViewGeometry key = CameraAt(0);
  const std::vector<ViewGeometry> one = {CameraAt(0.4)}, two = {CameraAt(0.4), CameraAt(-0.6)};
  EXPECT_NEAR(PixelsPerInverseDepth(key, one, 0.1, 0.5), 70 * 0.4, 1e-9);
  EXPECT_NEAR(PixelsPerInverseDepth(key, two, 0.1, 0.5), 70 * 0.6, 1e-9) << "the fastest counts";
  ViewGeometry behind = CameraAt(0);
  behind.cam_from_world.translation.z() = -1000;
  EXPECT_EQ(PixelsPerInverseDepth(key, std::vector{behind}, 0.1, 0.5), 0) << "sees none";
}

TEST(SweepGeometry, PlanesAreNoFartherApartThanAskedFor) {
  const PlaneSpacing spacing = SpacePlanes(0.1, 0.5, 29.5, 1.0, 256);
  EXPECT_EQ(spacing.count, 13u);  // 0.4 * 29.5 px want 12 steps
  EXPECT_DOUBLE_EQ(spacing.first, 0.1);
  EXPECT_NEAR(spacing.first + spacing.step * (spacing.count - 1), 0.5, 1e-12);
  EXPECT_EQ(SpacePlanes(0.1, 0.5, 3000, 1.0, 256).count, 256u);
  EXPECT_EQ(SpacePlanes(0.1, 0.5, 0.1, 1.0, 256).count, 3u);
}

TEST(ViewPyramid, HalfAViewSeesTheSameAlongARay) {
  View view;
  view.geometry = CameraAt(0);
  view.geometry.width_px = 81;  // odd: the last column is left out
  for (uint32_t y = 0; y < 60; ++y) {
    for (uint32_t x = 0; x < 81; ++x) view.gray.push_back(static_cast<uint8_t>(2 * x + y));
  }
  const View half = HalveView(view);
  EXPECT_EQ(half.geometry.width_px, 40u);
  EXPECT_EQ(half.geometry.height_px, 30u);
  ASSERT_EQ(half.gray.size(), 40u * 30u);
  EXPECT_EQ(half.gray[0], 2) << "the mean of 0, 2, 1, 3, rounded up from the middle";
  EXPECT_EQ(half.gray[40 * 7 + 9], 2 * 18.5 + 14.5 + 0.5);
  // The middle of four pixels lies on the same ray as the pixel that they became.
  const Eigen::Vector2d whole = view.geometry.camera.Normalize(Eigen::Vector2d(18.5, 14.5));
  const Eigen::Vector2d halved = half.geometry.camera.Normalize(Eigen::Vector2d(9, 7));
  EXPECT_NEAR((whole - halved).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace veduta
