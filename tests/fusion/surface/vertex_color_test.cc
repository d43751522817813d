// SPDX-License-Identifier: Apache-2.0
// Goal: a vertex gets the colour of the surface there: not that of what stands before it, of
//   who walked by, or of a photo's exposure; the same from both tiles that share it; and the
//   same on any number of threads.
// Method: a painted wall with a red board before it, photographed by rays through a formula;
//   the wall as a mesh, whole and cut into tiles.
#include "fusion/surface/vertex_color.h"

#include <limits>

#include "fusion/surface/color_fill.h"
#include "fusion/surface/robust_color.h"
#include "fusion/surface/tiles_between.h"
#include "tests/fusion/surface/sample_surfaces.h"

namespace veduta {
namespace {

constexpr double kStep = 0.05;
constexpr uint32_t kColumns = 80, kRows = 60;  // the wall: 4 x 3 at z = 0, seen from +z

// Light of the wall; red stays low, for the board is red.
Eigen::Vector3d WallLight(double x, double y) {
  return {0.05, 0.3 + 0.2 * std::sin(2.2 * x), 0.3 + 0.2 * std::cos(1.7 * y)};
}
const Eigen::Vector3d kBoardLight(0.8, 0.02, 0.02);
const Eigen::AlignedBox2d kBoard(Eigen::Vector2d(1.6, 1.1), Eigen::Vector2d(2.4, 1.9));
constexpr double kBoardZ = 1;

TriangleMesh BoardMesh() {
  TriangleMesh mesh;
  for (const auto corner : {Eigen::AlignedBox2d::BottomLeft, Eigen::AlignedBox2d::BottomRight,
                            Eigen::AlignedBox2d::TopLeft, Eigen::AlignedBox2d::TopRight}) {
    const Eigen::Vector2d at = kBoard.corner(corner);
    mesh.positions.push_back(Eigen::Vector3d(at.x(), at.y(), kBoardZ).cast<float>());
  }
  mesh.triangles = {{0, 1, 3}, {0, 3, 2}};
  mesh.normals = VertexNormals(mesh);
  return mesh;
}

ViewGeometry CameraAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  return LookAt(eye, target, Eigen::Vector3d::UnitY(), 320, 240, 60).value();
}

// The photo of wall and board; `exposure` multiplies the light.
View Photograph(uint32_t image, const ViewGeometry& g, const Eigen::Vector3d& exposure,
                bool with_board) {
  View view = {ImageId(image), g, {}, {}};
  const Rigid3 world_from_cam = g.cam_from_world.Inverse();
  const Eigen::Vector3d center = g.cam_from_world.Center();
  for (uint32_t i = 0; i < g.width_px * g.height_px; ++i) {
    // The mean of 2 x 2 rays.
    Eigen::Vector3d light = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d px(i % g.width_px + 0.5 * (k % 2) - 0.25,
                               i / g.width_px + 0.5 * (k / 2) - 0.25);
      const Eigen::Vector3d ray = world_from_cam.rotation * g.camera.Normalize(px).homogeneous();
      const Eigen::Vector3d board = center + (kBoardZ - center.z()) / ray.z() * ray;
      const Eigen::Vector3d wall = center - center.z() / ray.z() * ray;
      const bool is_board = with_board && kBoard.contains(Eigen::Vector2d(board.head<2>()));
      light += 0.25 * (is_board ? kBoardLight : WallLight(wall.x(), wall.y()));
    }
    for (int c = 0; c < 3; ++c)
      view.rgb.push_back(SrgbFromLight(static_cast<float>(light[c] * exposure[c])));
  }
  return view;
}

struct Gallery {
  std::vector<ColorView> views;
  std::vector<const ColorView*> pointers() const {
    std::vector<const ColorView*> list;
    for (const ColorView& view : views) list.push_back(&view);
    return list;
  }
  std::vector<Eigen::Vector3d> centers() const {
    std::vector<Eigen::Vector3d> list;
    for (const ColorView& view : views) list.push_back(view.center());
    return list;
  }
};

// Nine photos of different exposures; their gains undo these.
Gallery TakeGallery(bool with_board, bool with_gains = true) {
  Gallery gallery;
  for (uint32_t i = 0; i < 9; ++i) {
    const Eigen::Vector3d eye(0.2 + 1.8 * (i % 3), 0.3 + 1.2 * (i / 3), 3.4);
    const Eigen::Vector3d exposure = Eigen::Vector3d(1, 1, 1) * std::exp(0.4 * std::sin(2.0 * i));
    const View view = Photograph(i + 1, CameraAt(eye, {2, 1.5, 0}), exposure, with_board);
    const Eigen::Vector3f gain = with_gains ? Eigen::Vector3f(exposure.cwiseInverse().cast<float>())
                                            : Eigen::Vector3f(Eigen::Vector3f::Ones());
    gallery.views.push_back(ColorView::Make(view, gain).value());
  }
  return gallery;
}

ColoringOptions Options() {
  ColoringOptions options;
  options.voxel_size = kStep;
  return options;
}

double ErrorAt(const Eigen::Vector3f& position, const std::array<uint8_t, 3>& color) {
  const Eigen::Vector3d light = WallLight(position.x(), position.y());
  double error = 0;
  for (int c = 0; c < 3; ++c) {
    error = std::max(error,
                     std::abs(double{1} * color[c] - SrgbFromLight(static_cast<float>(light[c]))));
  }
  return error;
}

TEST(VertexColor, TheBoardsColourStaysOnTheBoard) {
  const TriangleMesh wall = FlatSheet(kColumns, kRows, kStep);
  const auto scene = SceneOf({wall, BoardMesh()}), blind = SceneOf({wall});
  const Gallery gallery = TakeGallery(true);
  ThreadPool pool(1);
  const VertexColors colors =
      ColorVertices(wall, *scene, gallery.pointers(), Options(), pool).value();
  size_t seen = 0, red = 0;
  double sum = 0;
  for (size_t v = 0; v < wall.positions.size(); ++v) {
    if (colors.view_counts[v] == 0) continue;
    ++seen;
    sum += ErrorAt(wall.positions[v], colors.colors[v]);
    red += colors.colors[v][0] > 90;  // the wall's is 63
    ASSERT_LT(ErrorAt(wall.positions[v], colors.colors[v]), 8) << wall.positions[v].transpose();
  }
  EXPECT_GT(seen, 0.9 * wall.positions.size());
  EXPECT_LT(sum / seen, 1.2);
  EXPECT_EQ(red, 0u);
  // The test can fail: who does not know of the board paints the wall red.
  const VertexColors bled =
      ColorVertices(wall, *blind, gallery.pointers(), Options(), pool).value();
  EXPECT_GT(std::count_if(bled.colors.begin(), bled.colors.end(),
                          [](const auto& c) { return c[0] > 90; }),
            20);
}

TEST(VertexColor, OnlyTheBoardsOutlineIsWeighedDown) {
  // One photo, so that nothing but the weight decides whether the colour is believed: with a margin
  // as without, the vertex next to the outline has a colour; and it is the wall's.
  const TriangleMesh wall = FlatSheet(kColumns, kRows, kStep);
  const auto scene = SceneOf({wall, BoardMesh()});
  Gallery gallery = TakeGallery(true);
  // A second photo whose pose is a little wrong: the board's red lies 2 px beside where the surface
  // has it.
  ViewGeometry moved = gallery.views[4].geometry();
  const View photo = Photograph(77, moved, {1, 1, 1}, true);
  moved.camera.cx += 2;
  View wrong = photo;
  wrong.geometry = moved;
  Gallery two;
  two.views = {gallery.views[0], ColorView::Make(wrong, {1, 1, 1}).value()};
  ThreadPool pool(0);
  const auto count_red = [&](double margin) {
    ColoringOptions options = Options();
    options.silhouette_margin_px = margin;
    const auto colors = ColorVertices(wall, *scene, two.pointers(), options, pool).value().colors;
    return std::count_if(colors.begin(), colors.end(), [](const auto& c) { return c[0] > 90; });
  };
  EXPECT_GT(count_red(0), 8);
  EXPECT_LT(count_red(3), count_red(0) / 2);
}

TEST(VertexColor, PassersByAreOutvoted) {
  const TriangleMesh wall = FlatSheet(kColumns, kRows, kStep);
  const auto scene = SceneOf({wall});
  Gallery gallery = TakeGallery(false);
  const View passed =
      Photograph(5, gallery.views[4].geometry(), {1, 1, 1}, true);  // the board, in one photo only
  gallery.views[4] = ColorView::Make(passed, {1, 1, 1}).value();
  ThreadPool pool(1);
  const VertexColors colors =
      ColorVertices(wall, *scene, gallery.pointers(), Options(), pool).value();
  size_t outvoted = 0;
  for (size_t v = 0; v < wall.positions.size(); ++v) {
    ASSERT_LT(ErrorAt(wall.positions[v], colors.colors[v]), 8) << wall.positions[v].transpose();
    outvoted += colors.view_counts[v] == 8;
  }
  EXPECT_GT(outvoted, 100u);
}

TEST(VertexColor, GainsEvenExposuresOut) {
  const TriangleMesh wall = FlatSheet(kColumns, kRows, kStep);
  const auto scene = SceneOf({wall});
  ThreadPool pool(1);
  const auto mean_error = [&](bool with_gains) {
    const Gallery gallery = TakeGallery(false, with_gains);
    const VertexColors colors =
        ColorVertices(wall, *scene, gallery.pointers(), Options(), pool).value();
    double sum = 0;
    for (size_t v = 0; v < wall.positions.size(); ++v)
      sum += ErrorAt(wall.positions[v], colors.colors[v]);
    return sum / wall.positions.size();
  };
  EXPECT_LT(mean_error(true), 1.5);
  EXPECT_GT(mean_error(false), 4 * mean_error(true));
}

TEST(VertexColor, TilesAgreeOnTheirBorders) {
  const TriangleMesh wall =
      Sheet(kColumns, kRows, kStep, [](double x, double y) { return 0.1 * std::sin(3 * x + y); });
  const Gallery gallery = TakeGallery(true);
  const auto centers = gallery.centers();
  std::vector<Tile> tiles = CutIntoTiles(wall, 0.7);
  std::vector<TriangleMesh> meshes = {BoardMesh()};
  for (const Tile& tile : tiles) meshes.push_back(tile.mesh);
  std::vector<std::shared_ptr<const RayTile>> all;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const TriangleMesh& mesh : meshes) {
    all.push_back(RayTile::Make(SampleDevice(), mesh).value());
    boxes.push_back(all.back()->box().cast<double>());
  }
  const ColoringOptions options = Options();
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(ColoringReach(options));
  ThreadPool pool(1);
  std::map<uint64_t, std::array<uint8_t, 3>> colors;
  size_t shared = 0, left_out = 0;
  for (const Tile& tile : tiles) {
    const Eigen::AlignedBox3d own = BoxOf(tile.mesh), target(own.min() - reach, own.max() + reach);
    std::vector<std::shared_ptr<const RayTile>> between;
    for (const uint32_t i : TilesBetween(boxes, target, centers)) between.push_back(all[i]);
    left_out += all.size() - between.size();
    const auto scene = RayScene::Make(SampleDevice(), between).value();
    const VertexColors own_colors =
        ColorVertices(tile.mesh, *scene, gallery.pointers(), options, pool).value();
    for (size_t v = 0; v < tile.keys.size(); ++v) {
      if (own_colors.view_counts[v] == 0) continue;
      const auto [it, is_new] = colors.try_emplace(tile.keys[v], own_colors.colors[v]);
      if (is_new) continue;
      ++shared;
      ASSERT_EQ(it->second, own_colors.colors[v]);
    }
  }
  EXPECT_GT(shared, 300u);
  EXPECT_GT(left_out, 10u);  // otherwise the scenes were all the same
  // And all is as if there were one tile.
  const auto whole = RayScene::Make(SampleDevice(), all).value();
  const VertexColors once = ColorVertices(wall, *whole, gallery.pointers(), options, pool).value();
  for (const auto& [v, color] : colors) ASSERT_EQ(once.colors[v], color);
}

TEST(VertexColor, ThreadsDoNotMatterNorTheOrderOfViews) {
  const TriangleMesh wall = FlatSheet(kColumns, kRows, kStep);
  const auto scene = SceneOf({wall, BoardMesh()});
  const Gallery gallery = TakeGallery(true);
  std::vector<const ColorView*> views = gallery.pointers();
  ThreadPool none(0), three(3);
  const VertexColors first = ColorVertices(wall, *scene, views, Options(), none).value();
  const VertexColors second = ColorVertices(wall, *scene, views, Options(), three).value();
  std::reverse(views.begin(), views.end());
  std::swap(views[2], views[6]);
  const VertexColors third = ColorVertices(wall, *scene, views, Options(), three).value();
  EXPECT_EQ(first.colors, second.colors);
  EXPECT_EQ(first.colors, third.colors);
  EXPECT_EQ(first.view_counts, third.view_counts);
}

TEST(VertexColor, WhatNobodySeesTakesItsNeighboursColours) {
  const TriangleMesh wall = FlatSheet(kColumns, kRows, kStep);
  const auto scene = SceneOf({wall, BoardMesh()});
  Gallery gallery;
  gallery.views.push_back(
      ColorView::Make(Photograph(1, CameraAt({2, 1.5, 4}, {2, 1.5, 0}), {1, 1, 1}, true), {1, 1, 1})
          .value());
  ThreadPool pool(1);
  const VertexColors colors =
      ColorVertices(wall, *scene, gallery.pointers(), Options(), pool).value();
  size_t hidden = 0;
  for (size_t v = 0; v < wall.positions.size(); ++v) {
    if (colors.view_counts[v] > 0 ||
        !kBoard.contains(Eigen::Vector2d(wall.positions[v].head<2>().cast<double>()))) {
      continue;
    }
    ++hidden;
    EXPECT_LT(colors.colors[v][0], 90);
    EXPECT_LT(ErrorAt(wall.positions[v], colors.colors[v]), 60);
  }
  EXPECT_GT(hidden, 200u);
  // From behind, all is filled in: there is nothing to fill in with.
  Gallery behind;
  behind.views.push_back(
      ColorView::Make(Photograph(1, CameraAt({2, 1.5, -4}, {2, 1.5, 0}), {1, 1, 1}, true),
                      {1, 1, 1})
          .value());
  const VertexColors grey = ColorVertices(wall, *scene, behind.pointers(), Options(), pool).value();
  for (const auto& color : grey.colors) ASSERT_EQ(color, (std::array<uint8_t, 3>{128, 128, 128}));
}

TEST(VertexColor, PhotosFromTooFarAwaySayNothing) {
  const TriangleMesh wall = FlatSheet(kColumns, kRows, kStep);
  const auto scene = SceneOf({wall});
  Gallery far;
  far.views.push_back(
      ColorView::Make(Photograph(1, CameraAt({2, 1.5, 70}, {2, 1.5, 0}), {1, 1, 1}, false),
                      {1, 1, 1})
          .value());
  ThreadPool pool(0);
  ColoringOptions options = Options();
  const auto seen = [&] {
    const VertexColors colors = ColorVertices(wall, *scene, far.pointers(), options, pool).value();
    return colors.view_counts.size() -
           std::count(colors.view_counts.begin(), colors.view_counts.end(), 0);
  };
  EXPECT_EQ(seen(), 0u);  // a pixel is 5 voxels wide
  options.voxels_per_pixel_max = 6;
  EXPECT_EQ(seen(), wall.positions.size());
}

TEST(VertexColor, SaysWhatIsWrong) {
  const auto scene = SceneOf({});
  ThreadPool pool(0);
  const auto message = [&](const TriangleMesh& mesh, std::vector<const ColorView*> views,
                           ColoringOptions options) {
    const auto result = ColorVertices(mesh, *scene, views, options, pool);
    return result.ok() ? std::string("ok") : result.status().message();
  };
  EXPECT_EQ(message({}, {}, Options()), "ok");
  EXPECT_NE(message({}, {}, {}).find("voxel_size"), std::string::npos);
  EXPECT_NE(message({}, {nullptr}, Options()).find("null"), std::string::npos);
  TriangleMesh mesh = FlatSheet(2, 2, 1);
  mesh.normals.clear();
  EXPECT_NE(message(mesh, {}, Options()).find("no normals"), std::string::npos);
  mesh = FlatSheet(2, 2, 1);
  mesh.positions[1].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(message(mesh, {}, Options()).find("position 1"), std::string::npos);

  View view = Photograph(9, CameraAt({2, 1.5, 4}, {2, 1.5, 0}), {1, 1, 1}, false);
  EXPECT_NE(ColorView::Make(view, {1, 0, 1}).status().message().find("photo 9"), std::string::npos);
  view.rgb.pop_back();
  EXPECT_EQ(ColorView::Make(view, {1, 1, 1}).status().code(), StatusCode::kInvalidArgument);
}

TEST(ColorView, SamplesLightAtTheSizeAskedFor) {
  // A chessboard of black and white pixels: half the light, which is sRGB 188; a ramp: the light in
  // between.
  View view = {ImageId(1), CameraAt({2, 1.5, 4}, {2, 1.5, 0}), {}, {}};
  for (uint32_t i = 0; i < 320 * 240; ++i) {
    const uint8_t value = (i % 320 + i / 320) % 2 == 0 ? 250 : 0;
    view.rgb.insert(view.rgb.end(), {value, value, value});
  }
  const ColorView chess = ColorView::Make(view, {1, 1, 1}).value();
  EXPECT_NEAR(chess.At({100, 100}, 1).light.x(), LightFromSrgb(250), 1e-4);
  EXPECT_NEAR(chess.At({101, 100}, 1).light.x(), 0, 1e-4);
  for (const double size : {2.0, 3.0, 4.0, 9.0}) {
    EXPECT_NEAR(chess.At({100.3, 57.8}, size).light.x(), 0.5 * LightFromSrgb(250), 1e-3);
  }
  for (uint32_t i = 0; i < 320 * 240; ++i) {
    for (int c = 0; c < 3; ++c) view.rgb[3 * i + c] = SrgbFromLight(0.1f + 0.002f * (i % 320));
  }
  const ColorView ramp = ColorView::Make(view, {2, 1, 1}).value();
  for (const double size : {1.0, 2.0, 4.0, 8.0}) {
    EXPECT_NEAR(ramp.At({100.4, 80.7}, size).light.y(), 0.1 + 0.002 * 100.4, 2e-3) << size;
    EXPECT_NEAR(ramp.At({100.4, 80.7}, size).light.x(), 2 * (0.1 + 0.002 * 100.4), 4e-3) << size;
  }
  for (int i = 0; i < 256; ++i) EXPECT_EQ(SrgbFromLight(LightFromSrgb(static_cast<uint8_t>(i))), i);
  EXPECT_EQ(SrgbFromLight(7), 255);
  EXPECT_EQ(SrgbFromLight(-1), 0);
}

TEST(RobustColor, TheHeavierOfTwoStandsAndTheMajorityOfMany) {
  const Eigen::Vector3f grey(0.2f, 0.2f, 0.2f), red(0.7f, 0.05f, 0.05f);
  std::vector<ColorSample> samples = {{red, 1, 1}, {grey, 1.5f, 2}};
  EXPECT_EQ(RobustMean(samples, 12, 3, 0.06f).light, grey);
  samples = {{red, 1.4f, 1}, {grey, 1, 2}, {1.05f * grey, 1, 3}};
  const RobustColor color = RobustMean(samples, 12, 3, 0.06f);
  EXPECT_EQ(color.count, 2u);
  EXPECT_NEAR(color.light.x(), 0.205, 1e-5);
  samples = {{red, 1.4f, 1}, {grey, 1, 2}, {1.05f * grey, 1, 3}};
  EXPECT_EQ(RobustMean(samples, 1, 3, 0.06f).light, red);  // one is all that is asked for
  EXPECT_EQ(RobustMean({}, 12, 3, 0.06f).count, 0u);
}

}  // namespace
}  // namespace veduta
