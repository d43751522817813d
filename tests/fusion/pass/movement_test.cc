// SPDX-License-Identifier: Apache-2.0
// Goal: how far poses have moved is measured where it shows, and a tile that a view may see is
//   never passed over.
// Method: points whose motion is known by hand; random views and tiles against every voxel corner
//   of the tile.
#include "fusion/pass/movement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fusion/pass/range_images.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

Rigid3 Shifted(double x, double z = 0) {
  Rigid3 pose;
  pose.translation = {x, 0, z};
  return pose;
}

TEST(Movement, InPixelsOfTheSensorView) {
  Pinhole camera;
  camera.fx = camera.fy = 100;
  const std::vector<Eigen::Vector3d> points(20, Eigen::Vector3d(0, 0, 5));
  EXPECT_NEAR(MovedPx(points, camera, Shifted(0.1), Shifted(0.15)), 100 * 0.05 / 5, 1e-12);
  EXPECT_EQ(MovedPx(points, camera, Shifted(0.1), Shifted(0.1)), 0);
  EXPECT_EQ(MovedPx({}, camera, Shifted(0), Shifted(9)), 0);
  EXPECT_EQ(MovedPx(points, camera, Shifted(0), Shifted(0, -10)),
            std::numeric_limits<double>::infinity())
      << "a point comes to lie behind the camera";
}

TEST(Movement, OneTenthOfThePointsMayMoveFarther) {
  std::vector<Eigen::Vector3d> points(19, Eigen::Vector3d(0, 0, 10));
  points.push_back({0, 0, 0.1});
  Pinhole camera;
  camera.fx = camera.fy = 100;
  EXPECT_NEAR(MovedPx(points, camera, Shifted(0), Shifted(0.01)), 0.1, 1e-12);
}

TEST(Movement, InTheWorld) {
  const std::vector<Eigen::Vector3d> points(20, Eigen::Vector3d(0, 0, 5));
  EXPECT_NEAR(MovedInWorld(points, Shifted(0), Shifted(0.25)), 0.25, 1e-12);
  Rigid3 turned;
  turned.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
  EXPECT_NEAR(MovedInWorld(points, Rigid3(), turned), 2 * 5 * std::sin(0.05), 1e-12);
}

TEST(Movement, LooksAtSomePointsOfAll) {
  Scene scene;
  SceneImage image;
  image.cam_from_world = Shifted(1);
  for (uint32_t i = 0; i < 2600; ++i) {
    scene.points.push_back({{}, Eigen::Vector3d(i, 0, 1), {}});
    image.observations.push_back({i, i});
  }
  const std::vector<Eigen::Vector3d> points = PointsInCamera(scene, image);
  EXPECT_LE(points.size(), 500u);
  EXPECT_GT(points.size(), 400u);
  EXPECT_EQ(points.front(), Eigen::Vector3d(1, 0, 1));
  EXPECT_GT(points.back().x(), 2500) << "spread over all";
}

TEST(MaySeeTile, PassesOverNoTileThatIsSeen) {
  const VolumeGrid grid{.voxel_size = 0.05};
  const double side = kTileSide * grid.voxel_size;
  SeededRandom random(3);
  size_t seen = 0, passed_over = 0;
  for (int i = 0; i < 4000; ++i) {
    ViewGeometry view;
    view.width_px = 64, view.height_px = 48;
    view.camera.fx = view.camera.fy = 50, view.camera.cx = 31.5, view.camera.cy = 23.5;
    const Eigen::Vector3d axis{random.Unit() - 0.5, random.Unit() - 0.5, random.Unit() - 0.5};
    view.cam_from_world.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(3 * random.Unit(), axis.normalized()));
    const GridPlace tile{static_cast<int32_t>(random.Below(7)) - 3,
                         static_cast<int32_t>(random.Below(7)) - 3,
                         static_cast<int32_t>(random.Below(7)) - 3};
    bool is_seen = false;
    for (int k = 0; k < 125; ++k) {
      const Eigen::Vector3d in_tile(k % 5 / 4.0, k / 5 % 5 / 4.0, k / 25 / 4.0);
      const Eigen::Vector3d x =
          view.cam_from_world * (side * (Eigen::Vector3d(tile.x, tile.y, tile.z) + in_tile));
      if (!(x.z() > 0 && x.z() < 6)) continue;
      const Eigen::Vector2d px = view.camera.Project(x);
      is_seen |= px.x() > 0 && px.x() < 63 && px.y() > 0 && px.y() < 47;
    }
    const bool may_see = MaySeeTile(view, 6, tile, grid);
    EXPECT_TRUE(may_see || !is_seen);
    seen += is_seen;
    passed_over += !may_see;
  }
  EXPECT_GT(seen, 100u);
  EXPECT_GT(passed_over, 1000u) << "and it does pass over many";
}

}  // namespace
}  // namespace veduta
