// SPDX-License-Identifier: Apache-2.0
// Goal: pictures show what is there: depth is exact, the nearest thing wins, tiles drawn one
//   after another make the picture of all at once, and cameras look where they are told to.
// Method: planes and spheres, whose depth is a formula; pictures on no, one and three threads;
//   PNG read by OpenCV.
#include "fusion/surface/renderer.h"

#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "fusion/surface/color_view.h"
#include "fusion/surface/reprojected_color.h"
#include "tests/fusion/surface/sample_surfaces.h"

namespace veduta {
namespace {

ViewGeometry FrontView(uint32_t width = 161, uint32_t height = 121) {
  return LookAt({2, 1.5, 4}, {2.3, 1.4, 0}, Eigen::Vector3d::UnitY(), width, height, 60).value();
}

Picture Draw(const RayScene& scene, const ViewGeometry& view, const RenderOptions& options,
             size_t threads = 1) {
  ThreadPool pool(threads);
  Picture picture = BlankPicture(view, options).value();
  EXPECT_TRUE(DrawSurface(scene, view, options, pool, &picture).ok());
  return picture;
}

TEST(Renderer, DepthOfAPlaneIsExact) {
  TriangleMesh sheet = FlatSheet(40, 30, 0.1);
  for (const Eigen::Vector3f& x : sheet.positions) {
    sheet.colors.push_back({static_cast<uint8_t>(60 * x.x()), static_cast<uint8_t>(80 * x.y()), 7});
  }
  const ViewGeometry view = FrontView();
  const Picture picture = Draw(*SceneOf({sheet}), view, {});
  const Eigen::Vector3d center = view.cam_from_world.Center();
  const Eigen::Matrix3d world_from_cam =
      view.cam_from_world.rotation.toRotationMatrix().transpose();
  int covered = 0;
  for (uint32_t i = 0; i < picture.depth.size(); ++i) {
    const Eigen::Vector2d px(i % view.width_px, i / view.width_px);
    const Eigen::Vector3d ray = world_from_cam * view.camera.Normalize(px).homogeneous();
    const double depth = -center.z() / ray.z();
    const Eigen::Vector3d at = center + depth * ray;
    const double inside = std::min({at.x(), at.y(), 4 - at.x(), 3 - at.y()});
    if (std::abs(inside) < 1e-3) continue;
    ASSERT_EQ(picture.depth[i] > 0, inside > 0) << px.transpose();
    if (inside < 0) {
      EXPECT_EQ(picture.rgb[3 * i], 255);
      continue;
    }
    ++covered;
    ASSERT_NEAR(picture.depth[i], depth, 2e-5);
    ASSERT_NEAR(picture.rgb[3 * i], 60 * at.x(), 1.6);
    ASSERT_NEAR(picture.rgb[3 * i + 1], 80 * at.y(), 1.6);
    ASSERT_EQ(picture.rgb[3 * i + 2], 7);
  }
  EXPECT_GT(covered, 5000);
}

TEST(Renderer, TilesOneAfterAnotherMakeTheSamePicture) {
  TriangleMesh sheet = Sheet(
      40, 30, 0.1, [](double x, double y) { return 0.5 * std::sin(2 * x) * std::cos(3 * y); });
  SeededRandom random(1);
  for (size_t v = 0; v < sheet.positions.size(); ++v) {
    sheet.colors.push_back(
        {static_cast<uint8_t>(random.Below(256)), static_cast<uint8_t>(random.Below(256)), 9});
  }
  const ViewGeometry view =
      LookAt({2, -2, 1}, {2, 1.5, 0}, Eigen::Vector3d::UnitZ(), 160, 120, 60).value();
  for (const Shading shading : {Shading::kColor, Shading::kClay, Shading::kNormal}) {
    RenderOptions options;
    options.shading = shading;
    const Picture whole = Draw(*SceneOf({sheet}), view, options, 0);
    EXPECT_TRUE(EqualPictures(whole, Draw(*SceneOf({sheet}), view, options, 3)));
    const std::vector<Tile> tiles = CutIntoTiles(sheet, 0.9);
    std::vector<TriangleMesh> meshes;
    Picture composed = BlankPicture(view, options).value();
    ThreadPool pool(1);
    for (size_t i = tiles.size(); i-- > 0;) {
      meshes.push_back(tiles[i].mesh);
      ASSERT_TRUE(DrawSurface(*SceneOf({tiles[i].mesh}), view, options, pool, &composed).ok());
    }
    EXPECT_TRUE(EqualPictures(whole, Draw(*SceneOf(meshes), view, options)));
    // At seams two triangles are equally far; elsewhere every pixel is the same.
    EXPECT_EQ(whole.depth, composed.depth);
    size_t differ = 0;
    for (size_t i = 0; i < whole.rgb.size(); ++i) differ += whole.rgb[i] != composed.rgb[i];
    EXPECT_LE(differ, whole.rgb.size() / 1000);
  }
}

TEST(Renderer, TheNearestWinsAndBackFacesAsAsked) {
  const TriangleMesh inner = Sphere({0, 0, 0}, 1, 40), outer = Sphere({0, 0, 0}, 2, 40);
  const auto scene = SceneOf({inner, outer});
  const ViewGeometry outside =
      LookAt({0, 0, 6}, {0, 0, 0}, Eigen::Vector3d::UnitY(), 101, 101, 50).value();
  const size_t middle = 50 * 101 + 50;
  EXPECT_NEAR(Draw(*scene, outside, {}).depth[middle], 4, 0.01);
  const ViewGeometry between =
      LookAt({0, 0, 1.5}, {0, 0, 9}, Eigen::Vector3d::UnitY(), 101, 101, 50).value();
  RenderOptions options;
  const Picture dark = Draw(*scene, between, options);
  EXPECT_NEAR(dark.depth[middle], 0.5, 0.01);  // the outer one's inside
  options.back_faces = BackFaces::kDraw;
  const Picture bright = Draw(*scene, between, options);
  EXPECT_GT(bright.rgb[3 * middle], 2 * dark.rgb[3 * middle]);
  options.back_faces = BackFaces::kCull;
  EXPECT_EQ(Draw(*scene, between, options).depth[middle], 0);
  // Through the near inside of the outer sphere onto the far inside's front: from outside, culling
  // changes nothing.
  EXPECT_NEAR(Draw(*scene, outside, options).depth[middle], 4, 0.01);
  // From inside the inner one: all four faces are seen from behind.
  const ViewGeometry inside =
      LookAt({0, 0, 0.2}, {0, 0, 9}, Eigen::Vector3d::UnitY(), 101, 101, 50).value();
  EXPECT_EQ(Draw(*scene, inside, options).depth[middle], 0);
}

TEST(Renderer, PointsAreDiscsBehindAndBeforeTheSurface) {
  const ViewGeometry view =
      LookAt({2, 1.5, 4}, {2, 1.5, 0}, Eigen::Vector3d::UnitY(), 201, 151, 60).value();
  RenderOptions options;
  options.point_radius_px = 3;
  const std::vector<CloudPoint> points = {
      {{2, 1.5f, 1}, {0, 0, 0}, {255, 0, 0}},
      {{2, 1.5f, -1}, {0, 0, 0}, {0, 255, 0}},  // behind the first
      {{1, 1.5f, -1}, {0, 0, 0}, {0, 0, 255}},  // behind the sheet
      {{2, 1.5f, 1}, {0, 0, 0}, {9, 9, 9}},     // where the first is already
      {{2, 1.5f, 5}, {0, 0, 0}, {9, 9, 9}}};    // behind the camera
  Picture picture = BlankPicture(view, options).value();
  ThreadPool pool(2);
  ASSERT_TRUE(DrawPoints(points, view, options, pool, &picture).ok());
  size_t red = 0, blue = 0, other = 0;
  for (size_t i = 0; i < picture.depth.size(); ++i) {
    const uint8_t* const c = picture.rgb.data() + 3 * i;
    if (c[0] == 255 && c[1] == 0) {
      ++red;
      EXPECT_EQ(picture.depth[i], 3);
    } else if (c[2] == 255 && c[0] == 0) {
      ++blue;
      EXPECT_EQ(picture.depth[i], 5);
    } else if (picture.depth[i] > 0) {
      ++other;
    }
  }
  EXPECT_EQ(red, 29u);  // whole pixels within 3 of a pixel's centre
  EXPECT_NEAR(blue, 28, 4);
  EXPECT_EQ(other, 0u);
  ASSERT_TRUE(DrawSurface(*SceneOf({FlatSheet(40, 30, 0.1)}), view, options, pool, &picture).ok());
  EXPECT_EQ(picture.depth[75 * 201 + 100], 3);
  EXPECT_EQ(std::count(picture.depth.begin(), picture.depth.end(), 5.0f), 0);
}

TEST(Renderer, CamerasLookWhereTheyShould) {
  const ViewGeometry view =
      LookAt({1, 2, 3}, {4, 6, 3}, Eigen::Vector3d::UnitZ(), 200, 100, 90).value();
  EXPECT_LT((view.cam_from_world.Center() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((view.cam_from_world * Eigen::Vector3d(4, 6, 3) - Eigen::Vector3d(0, 0, 5)).norm(),
            1e-12);
  EXPECT_LT(
      (view.cam_from_world.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0, -1, 0)).norm(),
      1e-12);
  EXPECT_NEAR(view.camera.Project({1, 0, 1}).x(), 199.5, 1e-9);
  EXPECT_FALSE(LookAt({1, 2, 3}, {1, 2, 3}, Eigen::Vector3d::UnitZ(), 200, 100, 90).ok());
  EXPECT_FALSE(LookAt({1, 2, 3}, {1, 2, 4}, Eigen::Vector3d::UnitZ(), 200, 100, 90).ok());
  EXPECT_FALSE(LookAt({1, 2, 3}, {1, 3, 4}, Eigen::Vector3d::UnitZ(), 200, 100, 180).ok());

  const Eigen::AlignedBox3d box(Eigen::Vector3d(-3, 2, 0), Eigen::Vector3d(20, 4, 7));
  const auto views = ThreeSides(box, Eigen::Vector3d::UnitZ(), {0.2, 1, -0.1}, 640, 360).value();
  for (const ViewGeometry& side : views) {
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d in_cam =
          side.cam_from_world * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
      ASSERT_GT(in_cam.z(), 0);
      const Eigen::Vector2d px = side.camera.Project(in_cam);
      left = std::min(left, px.x()), right = std::max(right, px.x());
      top = std::min(top, px.y()), bottom = std::max(bottom, px.y());
    }
    EXPECT_GT(std::min(left, top), 0);
    EXPECT_LT(right, 639);
    EXPECT_LT(bottom, 359);
    EXPECT_TRUE(left < 60 || right > 580 || top < 40 ||
                bottom > 320);  // and fills it, one way or the other
  }
  EXPECT_FALSE(ThreeSides({}, Eigen::Vector3d::UnitZ(), {1, 0, 0}, 640, 360).ok());
}

TEST(Renderer, LargerPicturesReduceToTheSamePlaces) {
  const auto scene = SceneOf({FlatSheet(40, 30, 0.1)});
  const ViewGeometry view = FrontView(160, 120), large = ScaledView(view, 3);
  EXPECT_EQ(large.width_px, 480u);
  const Picture small = Draw(*scene, view, {}), reduced = Reduced(Draw(*scene, large, {}), 3);
  ASSERT_EQ(reduced.depth.size(), small.depth.size());
  size_t differ = 0;
  for (size_t i = 0; i < small.depth.size(); ++i) {
    const bool in_both = small.depth[i] > 0 && reduced.depth[i] > 0;
    ASSERT_NEAR(small.depth[i], in_both ? reduced.depth[i] : small.depth[i], 0.03);
    differ += std::abs(small.rgb[3 * i] - reduced.rgb[3 * i]) > 2;
  }
  EXPECT_LT(differ, 600u);  // along the outline alone
}

TEST(Renderer, PngsReadBackAndErrorsAreNamed) {
  const SampleFolder folder("renderer");
  const ViewGeometry view = FrontView(33, 21);
  const Picture picture = Draw(*SceneOf({Sphere({2, 1.5, 0}, 1, 20)}), view, {});
  ASSERT_TRUE(WritePng(folder / "a.png", 33, 21, picture.rgb).ok());
  const cv::Mat read = cv::imread(folder / "a.png");
  ASSERT_EQ(read.cols, 33);
  for (int i = 0; i < 33 * 21; ++i) {
    for (int c = 0; c < 3; ++c) ASSERT_EQ(read.data[3 * i + 2 - c], picture.rgb[3 * i + c]);
  }
  EXPECT_EQ(WritePng(folder / "none/a.png", 33, 21, picture.rgb).code(), StatusCode::kIoError);
  EXPECT_EQ(WritePng(folder / "a.nothing", 33, 21, picture.rgb).code(), StatusCode::kIoError);
  EXPECT_EQ(WritePng(folder / "a.png", 33, 22, picture.rgb).code(), StatusCode::kInvalidArgument);

  ViewGeometry bad = view;
  bad.width_px = 0;
  EXPECT_FALSE(BlankPicture(bad, {}).ok());
  bad = view;
  bad.camera.fx = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(BlankPicture(bad, {}).ok());
  RenderOptions options;
  options.point_radius_px = 0;
  EXPECT_FALSE(BlankPicture(view, options).ok());
  ThreadPool pool(0);
  Picture other = BlankPicture(FrontView(32, 21), {}).value();
  EXPECT_FALSE(DrawSurface(*SceneOf({}), view, {}, pool, &other).ok());
}

TEST(ReprojectedColor, MeasuresDifferencesWithAndWithoutGains) {
  const TriangleMesh sphere = Sphere({2, 1.5, 0}, 1, 30);
  const ViewGeometry geometry = FrontView(160, 120);
  const Picture picture = Draw(*SceneOf({sphere}), geometry, {});
  View view = {ImageId(3), geometry, {}, picture.rgb};
  const ReprojectedColor same = CompareWithPhoto(picture, view, {1, 1, 1}).value();
  EXPECT_EQ(same.median_error, 0);
  EXPECT_EQ(same.mean_error_balanced, 0);
  const auto covered =
      std::count_if(picture.depth.begin(), picture.depth.end(), [](float d) { return d > 0; });
  EXPECT_NEAR(same.covered_share, covered / (160.0 * 120), 1e-12);
  EXPECT_GT(same.covered_share, 0.1);
  // The photo is half as bright: a gain of two brings it back.
  for (uint8_t& value : view.rgb) value = SrgbFromLight(0.5f * LightFromSrgb(value));
  const ReprojectedColor half = CompareWithPhoto(picture, view, {2, 2, 2}).value();
  EXPECT_GT(half.median_error, 30);
  EXPECT_LE(half.median_error_balanced, 1);
  // Outside, nothing counts.
  for (size_t i = 0; i < picture.depth.size(); ++i) {
    if (picture.depth[i] == 0) view.rgb[3 * i] = 0;
  }
  EXPECT_EQ(CompareWithPhoto(picture, view, {2, 2, 2}).value().median_error, half.median_error);
  const Picture sheet = SideBySide(picture, view, {2, 2, 2}).value();
  EXPECT_EQ(sheet.width_px, 480u);
  EXPECT_EQ(sheet.rgb[3 * (60 * 480 + 160 + 80)], picture.rgb[3 * (60 * 160 + 80)]);
  EXPECT_EQ(
      CompareWithPhoto(BlankPicture(geometry, {}).value(), view, {1, 1, 1}).value().covered_share,
      0);
  view.rgb.clear();
  EXPECT_FALSE(CompareWithPhoto(picture, view, {1, 1, 1}).ok());
  EXPECT_FALSE(SideBySide(picture, view, {1, 1, 1}).ok());
}

}  // namespace
}  // namespace veduta
