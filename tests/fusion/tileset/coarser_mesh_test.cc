// SPDX-License-Identifier: Apache-2.0
// Goal: the surface of a coarse node is near that of its leaves, as its error says, meets that of
//   its neighbours, and has about as many triangles as a leaf.
// Method: a hilly sheet over tiles on all sides of the origin, with vertices where marching cubes
//   have them: on lines through middles of voxels. Distances are measured both ways.
#include "fusion/tileset/coarser_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <tuple>

#include "fusion/surface/color_view.h"
#include "fusion/surface/simplification.h"
#include "fusion/volume/grid.h"

namespace veduta {
namespace {

constexpr double kVoxel = 0.05;
constexpr int32_t kSide = 4;  // tiles along x and y: [-2, 2)

double HeightAt(double x, double y) {
  return 1.5 + 0.9 * std::sin(1.1 * x) * std::cos(0.7 * y);  // within the tiles of z 0
}

// The part of the sheet in the tile at x, y, 0.
TriangleMesh SheetOf(const GridPlace& tile) {
  TriangleMesh mesh;
  for (int32_t j = 0; j <= kTileSide; ++j) {
    for (int32_t i = 0; i <= kTileSide; ++i) {
      const double x = (tile.x * kTileSide + i + 0.5) * kVoxel,
                   y = (tile.y * kTileSide + j + 0.5) * kVoxel;
      mesh.positions.push_back(Eigen::Vector3d(x, y, HeightAt(x, y)).cast<float>());
      mesh.colors.push_back({static_cast<uint8_t>(i * 3), static_cast<uint8_t>(j * 3), 90});
    }
  }
  for (uint32_t j = 0; j < kTileSide; ++j) {
    for (uint32_t i = 0; i < kTileSide; ++i) {
      const uint32_t a = j * (kTileSide + 1) + i, c = a + kTileSide + 1;
      mesh.triangles.push_back({a, a + 1, c + 1});
      mesh.triangles.push_back({a, c + 1, c});
    }
  }
  return mesh;
}

struct Sheet {
  TileTree tree;
  std::vector<TriangleMesh> meshes;  // of its nodes
};

Sheet MakeSheet() {
  std::vector<TileLeaf> leaves;
  for (int32_t x = -kSide / 2; x < kSide / 2; ++x) {
    for (int32_t y = -kSide / 2; y < kSide / 2; ++y) leaves.push_back({{x, y, 0}, ~0ull, 1});
  }
  Sheet sheet{*TileTree::Make(leaves, kVoxel), {}};
  for (const TileNode& node : sheet.tree.nodes()) {
    if (node.level == 0) {
      sheet.meshes.push_back(SheetOf(node.place));
      continue;
    }
    std::vector<const TriangleMesh*> children;
    for (const uint32_t child : node.children) children.push_back(&sheet.meshes[child]);
    auto mesh = JoinCells(node, kVoxel, children);
    EXPECT_TRUE(mesh.ok()) << mesh.status().message();
    sheet.meshes.push_back(*std::move(mesh));
  }
  return sheet;
}

void AddLeaves(const Sheet& sheet, uint32_t at, TriangleMesh* all) {
  const TileNode& node = sheet.tree.nodes()[at];
  for (const uint32_t child : node.children) AddLeaves(sheet, child, all);
  if (node.level > 0) return;
  const auto first = static_cast<uint32_t>(all->positions.size());
  const TriangleMesh& mesh = sheet.meshes[at];
  all->positions.insert(all->positions.end(), mesh.positions.begin(), mesh.positions.end());
  for (const auto& [a, b, c] : mesh.triangles)
    all->triangles.push_back({first + a, first + b, first + c});
}

TEST(CoarserMesh, IsAsNearAsItsErrorSaysAndHasFewTriangles) {
  const Sheet sheet = MakeSheet();
  const auto& nodes = sheet.tree.nodes();
  ASSERT_EQ(nodes.back().level, 2u);
  for (uint32_t i = 0; i < nodes.size(); ++i) {
    const TriangleMesh& mesh = sheet.meshes[i];
    for (const Eigen::Vector3f& x : mesh.positions)
      EXPECT_TRUE(nodes[i].box.contains(x.cast<double>()));
    if (nodes[i].level == 0) continue;
    TriangleMesh leaves;
    AddLeaves(sheet, i, &leaves);
    EXPECT_LE(mesh.triangles.size(), 1.6 * 2 * kTileSide * kTileSide);
    EXPECT_GE(mesh.triangles.size(), 0.8 * 2 * kTileSide * kTileSide);
    const auto there = DistanceTo(leaves, mesh, kVoxel), back = DistanceTo(mesh, leaves, kVoxel);
    ASSERT_TRUE(there.ok() && back.ok());
    EXPECT_LE(std::max(*there, *back), nodes[i].geometric_error);
    EXPECT_EQ(mesh.colors.size(), mesh.positions.size());
  }
}

TEST(CoarserMesh, MeetsItsNeighbours) {
  const Sheet sheet = MakeSheet();
  using Places = std::set<std::tuple<float, float, float>>;
  std::map<GridPlace, Places> on_plane;  // x and y through the middle of the voxel at the origin
  const auto plane = static_cast<float>(0.5 * kVoxel);
  for (size_t i = 0; i < sheet.meshes.size(); ++i) {
    if (sheet.tree.nodes()[i].level != 1) continue;
    for (const Eigen::Vector3f& x : sheet.meshes[i].positions) {
      if (x.x() == plane) on_plane[sheet.tree.nodes()[i].place].insert({x.x(), x.y(), x.z()});
    }
  }
  ASSERT_EQ(on_plane.size(), 4u);
  for (const int32_t y : {-1, 0}) {
    const Places& left = on_plane[{-1, y, 0}];
    EXPECT_GE(left.size(), 60u);
    EXPECT_EQ(left, (on_plane[{0, y, 0}]));
  }
}

TEST(CoarserMesh, MixesLightAndDropsWhatHasNoArea) {
  TileNode node;
  node.level = 1;
  TriangleMesh mesh;
  // Two vertices in the first cell, one in each of two others.
  for (const double x : {0.6, 1.6, 4.0, 8.0})
    mesh.positions.push_back((Eigen::Vector3d(x, 1, x > 7 ? 7 : 1) * kVoxel).cast<float>());
  mesh.colors = {{0, 0, 0}, {255, 255, 255}, {9, 9, 9}, {9, 9, 9}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {3, 1, 2}, {2, 3, 1}};
  const TriangleMesh* const children[] = {&mesh};
  const auto joined = JoinCells(node, kVoxel, children);
  ASSERT_TRUE(joined.ok()) << joined.status().message();
  EXPECT_EQ(joined->triangles.size(), 1u);  // one had no area, one was there three times
  EXPECT_EQ(joined->positions.size(), 3u);
  EXPECT_NEAR(double{joined->positions[0].x()}, 1.1 * kVoxel, 1e-6);
  EXPECT_EQ(joined->colors[0][0], SrgbFromLight(0.5f));
  EXPECT_EQ(JoinCells(node, kVoxel, children)->positions, joined->positions);
  EXPECT_TRUE(JoinCells(node, kVoxel, {})->triangles.empty());
}

TEST(CoarserMesh, RefusesWhatIsNoSurfaceOfTheNode) {
  TileNode node;
  node.level = 1;
  const TriangleMesh right = SheetOf({0, 0, 0});
  const auto code = [&](const TriangleMesh& mesh) {
    const TriangleMesh* const children[] = {&mesh};
    return JoinCells(node, kVoxel, children).status().code();
  };
  EXPECT_EQ(code(right), StatusCode::kOk);
  TriangleMesh wrong = right;
  wrong.colors.clear();
  EXPECT_EQ(code(wrong), StatusCode::kInvalidArgument);
  wrong = right;
  wrong.positions[5].x() = 1e30f;
  EXPECT_EQ(code(wrong), StatusCode::kInvalidArgument);
  wrong = right;
  wrong.triangles[0][0] = 1u << 31;
  EXPECT_EQ(code(wrong), StatusCode::kInvalidArgument);
  node.place = {40, 0, 0};
  EXPECT_EQ(code(right), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
