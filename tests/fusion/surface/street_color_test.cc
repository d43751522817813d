// SPDX-License-Identifier: Apache-2.0
// Goal: the street's true surface, coloured tile by tile from its photos of different
//   exposures, looks like each photo.
// Method: a stretch of the rendered street with its true poses; gains from what the photos see
//   of some vertices; tiles coloured each by a scene of what stands between; then drawn from
//   the photos' own cameras.
#include <gtest/gtest.h>

#include "fusion/surface/renderer.h"
#include "fusion/surface/reprojected_color.h"
#include "fusion/surface/tiles_between.h"
#include "fusion/surface/vertex_color.h"
#include "tools/surface/street_surface.h"

namespace veduta {
namespace {

constexpr double kVoxel = 0.06;

std::vector<street::PhotoView> TakePhotos(const street::Scene& scene) {
  CameraModel model;
  model.width_px = 256;
  model.height_px = 192;
  model.fx = model.fy = 220;
  model.cx = model.u0 = 127.5;
  model.cy = model.v0 = 95.5;
  std::vector<street::StreetCamera> cameras;
  for (int i = 0; i < 5; ++i) {
    const double yaw = 90 + 25 * std::sin(1.3 * i);
    cameras.push_back({"photo", model, street::LookFrom({10 + 1.1 * i, -2, 1.65}, yaw, 6, 0)});
  }
  street::RenderOptions render;
  render.noise_sigma = 2;
  render.exposure_stops = 0.5;
  return street::TakeViews(scene, cameras, render, 2).value();
}

// The tiles with colours. Vertices that two tiles share must have the same one in both.
std::vector<std::shared_ptr<const RayTile>> ColorTiles(const std::vector<street::MeshTile>& tiles,
                                                       const std::vector<ColorView>& views,
                                                       std::shared_ptr<const RayDevice> device,
                                                       ThreadPool& pool) {
  std::vector<const ColorView*> pointers;
  std::vector<Eigen::Vector3d> centers;
  for (const ColorView& view : views) pointers.push_back(&view), centers.push_back(view.center());
  std::vector<std::shared_ptr<const RayTile>> bare, colored;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const street::MeshTile& tile : tiles) {
    bare.push_back(RayTile::Make(device, tile.mesh).value());
    boxes.push_back(bare.back()->box().cast<double>());
  }
  ColoringOptions coloring;
  coloring.voxel_size = kVoxel;
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(ColoringReach(coloring));
  std::map<uint64_t, std::array<uint8_t, 3>> border;
  size_t shared = 0, different = 0;
  for (size_t i = 0; i < tiles.size(); ++i) {
    std::vector<std::shared_ptr<const RayTile>> between;
    for (const uint32_t k :
         TilesBetween(boxes, {boxes[i].min() - reach, boxes[i].max() + reach}, centers)) {
      between.push_back(bare[k]);
    }
    const auto around = RayScene::Make(device, between).value();
    const VertexColors colors =
        ColorVertices(tiles[i].mesh, *around, pointers, coloring, pool).value();
    for (size_t v = 0; v < tiles[i].keys.size(); ++v) {
      if (colors.view_counts[v] == 0) continue;
      const auto [it, is_new] = border.try_emplace(tiles[i].keys[v], colors.colors[v]);
      if (is_new) continue;
      ++shared;
      different += it->second != colors.colors[v];
    }
    TriangleMesh mesh = tiles[i].mesh;
    mesh.colors = colors.colors;
    colored.push_back(RayTile::Make(device, std::move(mesh)).value());
  }
  EXPECT_GT(shared, 300u);
  EXPECT_EQ(different, 0u);
  return colored;
}

TEST(StreetColor, LooksLikeThePhotos) {
  street::SceneOptions options;
  options.seed = 7;
  options.length_m = 24;
  const auto scene = street::BuildScene(options).value();
  const std::vector<street::PhotoView> photos = TakePhotos(*scene);
  const TriangleMesh whole = street::SurfaceOf(*scene, kVoxel, [](const Eigen::Vector3d& x) {
    return x.x() > 7 && x.x() < 18 && x.y() > 0 && x.y() < 9 && x.z() < 6;
  });
  const std::vector<street::MeshTile> tiles = street::CutIntoCubes(whole, 64 * kVoxel);
  ASSERT_GT(tiles.size(), 8u);
  const auto gains = SolveExposures(ObserveVertices(whole, photos, 37), {}, {}).value();
  const auto device = RayDevice::Open().value();
  std::vector<ColorView> views;
  for (const street::PhotoView& photo : photos) {
    views.push_back(ColorView::Make(photo.view, gains.at(photo.view.image)).value());
  }
  ThreadPool pool(1);
  const auto surface = RayScene::Make(device, ColorTiles(tiles, views, device, pool)).value();
  double worst_plain = 0;
  for (const street::PhotoView& photo : photos) {
    Picture picture = BlankPicture(photo.view.geometry, {}).value();
    ASSERT_TRUE(DrawSurface(*surface, photo.view.geometry, {}, pool, &picture).ok());
    const auto error = CompareWithPhoto(picture, photo.view, gains.at(photo.view.image)).value();
    std::printf(
        "photo %u: covered %.1f %%, median error %.0f, exposure evened out %.0f, mean %.2f\n",
        photo.view.image.value, 100 * error.covered_share, error.median_error,
        error.median_error_balanced, error.mean_error_balanced);
    EXPECT_GT(error.covered_share, 0.4);  // the stretch is cut off on both sides
    EXPECT_LE(error.median_error_balanced, 8);
    worst_plain = std::max(worst_plain, error.median_error);
    // Where the surface is, its depth is the photo's.
    size_t same = 0, covered = 0;
    for (size_t i = 0; i < picture.depth.size(); ++i) {
      if (picture.depth[i] == 0) continue;
      ++covered;
      same += std::abs(picture.depth[i] - photo.depth[i]) < 1e-3 * photo.depth[i];
    }
    EXPECT_GT(same, 0.99 * covered);
  }
  EXPECT_GT(worst_plain, 10);  // exposures do differ
}

}  // namespace
}  // namespace veduta
