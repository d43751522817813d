// SPDX-License-Identifier: Apache-2.0
// Goal: a lens is adjusted by what fits and holds together alone: what lies elsewhere, what is seen
//   from one side, and views that see too little are left out, and the rest says what the lens is.
// Method: a made-up scene of known truth, spoilt in each of these ways.
#include "engine/lens_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

#include "engine/camera/projection.h"
#include "storage/base/content_hash.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

CameraModel Truth() {
  CameraModel camera;
  camera.width_px = 1000, camera.height_px = 750;
  camera.fx = camera.fy = 800;
  camera.cx = camera.u0 = 501, camera.cy = camera.v0 = 373;
  camera.k1 = -0.06;
  return camera;
}

// Points in a box before cameras on an arc, near and far.
LensScene MakeScene(uint32_t views = 8, uint32_t points = 200,
                    const CameraModel& camera = Truth()) {
  LensScene made;
  made.scene.camera() = camera;
  SeededRandom random(3);
  for (uint32_t p = 0; p < points; ++p)
    made.scene.points.push_back({4 * random.Unit() - 2, 3 * random.Unit() - 1.5, random.Unit()});
  for (uint32_t v = 0; v < views; ++v) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.12 * v - 0.4, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(v % 3 * 1.5, Eigen::Vector3d::UnitZ()));
    made.scene.cams_from_world.push_back({turn, Eigen::Vector3d(0, 0, 5 + 0.4 * (v % 4))});
    made.photos.push_back(10 + v);
  }
  for (uint32_t p = 0; p < points; ++p) {
    for (uint32_t v = 0; v < views; ++v) {
      const Eigen::Vector2d noise{random.Unit() - 0.5, random.Unit() - 0.5};
      const auto px = PixelFromBearing(made.scene.camera(),
                                       made.scene.cams_from_world[v] * made.scene.points[p]);
      made.observations.push_back({v, p, DistortPixel(made.scene.camera(), *px) + 0.4 * noise, 1});
    }
  }
  return made;
}

TEST(LensScene, WhatIsLooseIsDroppedRoundByRound) {
  LensScene scene = MakeScene();
  const size_t observations = scene.observations.size();
  DropLoose(&scene);
  EXPECT_EQ(scene.observations.size(), observations) << "nothing is loose";

  // A point that two views see, one far away, and a view that sees only these and few others.
  const auto far = static_cast<uint32_t>(scene.scene.points.size());
  scene.scene.points.push_back({0, 0, 1e5});
  scene.scene.points.push_back({0.1, 0.1, 0});
  for (uint32_t v = 0; v < 8; ++v) scene.observations.push_back({v, far, {500, 370}, 1});
  for (uint32_t v = 0; v < 2; ++v) scene.observations.push_back({v, far + 1, {500, 370}, 1});
  scene.scene.cams_from_world.insert(scene.scene.cams_from_world.begin(),
                                     scene.scene.cams_from_world.front());
  scene.photos.insert(scene.photos.begin(), 99);
  for (PlaneObservation& one : scene.observations) ++one.view;
  for (uint32_t p = 0; p < 8; ++p) scene.observations.push_back({0, p, {500, 370}, 1});
  DropLoose(&scene);
  EXPECT_EQ(scene.scene.points.size(), far);
  EXPECT_EQ(scene.photos.size(), 8u);
  EXPECT_EQ(scene.photos.front(), 10u);
  EXPECT_EQ(scene.scene.cams_from_world.size(), 8u);
  ASSERT_EQ(scene.observations.size(), observations);
  for (const PlaneObservation& one : scene.observations) {
    ASSERT_LT(one.view, 8u);
    ASSERT_LT(one.point, far);
  }

  LensScene little = MakeScene(2);
  DropLoose(&little);
  EXPECT_TRUE(little.observations.empty()) << "two views see no contradiction";
  EXPECT_TRUE(little.photos.empty());
  EXPECT_TRUE(little.scene.points.empty());
}

TEST(LensScene, ACameraWithoutAViewThatIsLeftGoes) {
  LensScene scene = MakeScene();
  scene.scene.cameras.resize(3, Truth());
  scene.scene.cameras[2].fx = 700;
  scene.cameras = {0, 1, 2};
  scene.scene.camera_of_view = {0, 2, 0, 2, 1, 2, 0, 2};
  std::erase_if(scene.observations, [](const PlaneObservation& one) { return one.view == 4; });
  DropLoose(&scene);
  EXPECT_EQ(scene.cameras, (std::vector<uint32_t>{0, 2}));
  ASSERT_EQ(scene.scene.cameras.size(), 2u);
  EXPECT_EQ(scene.scene.cameras[1].fx, 700);
  EXPECT_EQ(scene.scene.camera_of_view, (std::vector<uint32_t>{0, 1, 0, 1, 1, 0, 1}));
}

TEST(LensScene, CroppedPhotosMayHaveTheirPrincipalPointAnywhere) {
  CameraModel cropped = Truth();
  cropped.cx = cropped.u0 = cropped.cx + 0.06 * cropped.width_px;
  cropped.cy = cropped.v0 = cropped.cy - 0.05 * cropped.width_px;
  LensScene scene = MakeScene(8, 200, cropped);
  scene.scene.camera() = Truth();
  const auto adjusted = AdjustLens(scene, 4);
  ASSERT_OK(adjusted);
  ASSERT_TRUE(adjusted->has_value());
  const CameraModel& found = (*adjusted)->scene.scene.camera();
  EXPECT_NEAR(found.cx, cropped.cx, 0.003 * cropped.width_px);
  EXPECT_NEAR(found.cy, cropped.cy, 0.003 * cropped.width_px);
  EXPECT_NEAR(found.fx / cropped.fx, 1, 0.003);
}

TEST(LensScene, WhatDoesNotFitSpoilsNoLens) {
  LensScene scene = MakeScene();
  for (size_t i = 0; i < scene.observations.size(); i += 17)
    scene.observations[i].px += Eigen::Vector2d(30, -20);
  const size_t wrong = (scene.observations.size() + 16) / 17;
  scene.scene.camera().fx = scene.scene.camera().fy = 1.1 * Truth().fx;
  scene.scene.camera().k1 = 0;
  const size_t all = scene.observations.size();
  const auto adjusted = AdjustLens(scene, 4);
  ASSERT_OK(adjusted);
  ASSERT_TRUE(adjusted->has_value());
  const AdjustedLens& lens = **adjusted;
  ASSERT_TRUE(lens.made.is_determined);
  EXPECT_NEAR(lens.scene.scene.camera().fx, Truth().fx, 4 * lens.FocalShare() * Truth().fx);
  EXPECT_LT(lens.FocalShare(), 0.005);
  EXPECT_NEAR(lens.scene.scene.camera().k1, Truth().k1, 0.01);
  EXPECT_LE(lens.scene.observations.size(), all - wrong);
  EXPECT_GT(lens.scene.observations.size(), all - 2 * wrong);
  for (const Eigen::Vector2d& residual : lens.made.residuals_px) EXPECT_LT(residual.norm(), 2);

  const auto too_few = AdjustLens(MakeScene(3), 4);
  ASSERT_OK(too_few);
  EXPECT_FALSE(too_few->has_value());
}

// Views of cameras that differ by the focal length alone, adjusted as if one had taken all.
AdjustedLens AdjustAsOne(const std::vector<double>& focals_px) {
  LensScene scene = MakeScene(0, 200);
  for (uint32_t v = 0; v < focals_px.size(); ++v) {
    CameraModel own = Truth();
    own.fx = own.fy = focals_px[v];
    const LensScene taken = MakeScene(static_cast<uint32_t>(focals_px.size()), 200, own);
    scene.scene.cams_from_world.push_back(taken.scene.cams_from_world[v]);
    scene.photos.push_back(taken.photos[v]);
    std::ranges::copy_if(taken.observations, std::back_inserter(scene.observations),
                         [&](const PlaneObservation& one) { return one.view == v; });
  }
  auto adjusted = AdjustLens(std::move(scene), 4);
  EXPECT_OK(adjusted);
  EXPECT_TRUE(adjusted.ok() && adjusted->has_value());
  return std::move(**adjusted);
}

TEST(LensScene, PhotosOfSeveralFocalLengthsHaveNoCommonCamera) {
  const AdjustedLens several = AdjustAsOne({800, 900, 700, 1000, 820, 640, 950, 760});
  const auto many = ListManyLensed(several.scene, 4);
  ASSERT_OK(many);
  EXPECT_EQ(*many, (std::vector<uint32_t>{0}));

  // An autofocus changes it by a percent.
  const AdjustedLens one = AdjustAsOne({800, 806, 800, 795, 803, 800, 808, 798});
  const auto none = ListManyLensed(one.scene, 4);
  ASSERT_OK(none);
  EXPECT_TRUE(none->empty());
}

}  // namespace
}  // namespace veduta
