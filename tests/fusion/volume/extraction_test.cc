// SPDX-License-Identifier: Apache-2.0
// Goal: pieces of neighbouring tiles fit each other to the byte; floaters go on both sides of a
//   border; nothing is drawn where nobody looked; stored pieces come back and hostile bytes are
//   refused.
// Method: solutions made from formulas (spheres that cross borders, of sizes around the limit);
//   every edge counted.
#include "fusion/volume/extraction.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "storage/base/content_hash.h"
#include "tests/fusion/volume/small_volume.h"

namespace veduta {
namespace {

// u of a voxel, from its coordinates' centre, in voxels.
using Field = std::function<double(const Eigen::Vector3d&)>;

SmallVolume VolumeOf(const Field& field, int32_t blocks_each_way) {
  SmallVolume volume;
  volume.grid = {0.1, 4};
  for (int32_t x = -blocks_each_way; x < blocks_each_way; ++x) {
    for (int32_t y = -blocks_each_way; y < blocks_each_way; ++y) {
      for (int32_t z = -blocks_each_way; z < blocks_each_way; ++z) {
        auto solution = std::make_unique<SolutionBlock>();
        for (int i = 0; i < kBlockVoxels; ++i) {
          const Eigen::Vector3d at(16 * x + i % 16 + 0.5, 16 * y + i / 16 % 16 + 0.5,
                                   16 * z + i / 256 + 0.5);
          solution->value[i] =
              static_cast<int16_t>(std::lround(std::clamp(field(at) / 4, -1., 1.) * kSolutionOne));
          solution->support[i] = std::abs(solution->value[i]) < kSolutionOne ? 6 : 1;
        }
        volume.solutions.emplace(GridPlace{x, y, z}, std::move(solution));
        volume.histograms.emplace(GridPlace{x, y, z}, nullptr);  // names the tiles
      }
    }
  }
  return volume;
}

Field Ball(const Eigen::Vector3d& center, double radius) {
  return [=](const Eigen::Vector3d& at) { return (at - center).norm() - radius; };
}
Field Both(const Field& a, const Field& b) {
  return [=](const Eigen::Vector3d& at) { return std::min(a(at), b(at)); };
}

bool IsClosed(const SurfacePiece& surface) {
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const auto& t : surface.triangles) {
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    return edge.second == 1 && edges.count({edge.first.second, edge.first.first}) == 1;
  });
}

TEST(ExtractSurface, FitsAcrossTiles) {
  const SmallVolume volume = VolumeOf(Ball({0.3, 0.2, -0.4}, 21.3), 3);
  std::map<VertexKey, std::pair<Eigen::Vector3f, Eigen::Vector3f>> seen;
  size_t shared = 0;
  for (const GridPlace& tile : volume.Tiles()) {
    const SurfacePiece piece = volume.Extract(tile, {});
    EXPECT_TRUE(std::is_sorted(piece.keys.begin(), piece.keys.end()));
    EXPECT_FALSE(piece.triangles.empty());
    for (size_t i = 0; i < piece.keys.size(); ++i) {
      const auto [found, is_new] =
          seen.insert({piece.keys[i], {piece.positions[i], piece.normals[i]}});
      if (is_new) continue;
      ++shared;
      ASSERT_EQ(found->second.first, piece.positions[i]);
      ASSERT_EQ(found->second.second, piece.normals[i]);
    }
  }
  EXPECT_GT(shared, 100u);
  const SurfacePiece whole = volume.Surface({});
  EXPECT_EQ(whole.keys.size(), seen.size());
  EXPECT_TRUE(IsClosed(whole));
  EXPECT_EQ(static_cast<int>(whole.keys.size()) - static_cast<int>(whole.triangles.size()) / 2, 2);
  for (size_t i = 0; i < whole.positions.size(); ++i) {
    const Eigen::Vector3d in_voxels =
        whole.positions[i].cast<double>() / 0.1 - Eigen::Vector3d(0.3, 0.2, -0.4);
    ASSERT_NEAR(in_voxels.norm(), 21.3, 0.05);
    ASSERT_GT(whole.normals[i].cast<double>().dot(in_voxels.normalized()), 0.98);
    ASSERT_EQ(whole.near_maps[i], 5);
  }
}

TEST(ExtractSurface, DropsFloatersOnBothSidesOfABorder) {
  const Field wall = Ball({0, 0, -1000}, 990);  // cut by the volume's end
  for (const double radius : {5.4, 7.0, 9.0}) {
    // Across the border x = 0, in turn more on the one side and on the other.
    for (const double x : {-4.0, 0.1, 3.0}) {
      const SmallVolume volume = VolumeOf(Both(wall, Ball({x, 3.2, 14.1}, radius)), 2);
      const auto count_above = [&](uint32_t extent, const GridPlace& tile) {
        size_t count = 0;
        const SurfacePiece piece = volume.Extract(tile, {.piece_extent_cells_min = extent});
        for (const auto& t : piece.triangles) count += piece.positions[t[0]].z() > 0.3 ? 1 : 0;
        return count;
      };
      // A ball of radius r takes between 2 r and 2 r + 2 cells.
      const bool is_floater = 2 * radius + 2 <= 15;
      for (const GridPlace& tile : {GridPlace{-1, 0, 0}, GridPlace{0, 0, 0}}) {
        EXPECT_GT(count_above(0, tile), 0u);
        if (is_floater) {
          EXPECT_EQ(count_above(15, tile), 0u) << radius << " at " << x;
        } else if (2 * radius > 15) {
          EXPECT_EQ(count_above(15, tile), count_above(0, tile)) << radius << " at " << x;
        } else {  // whatever the rule says, both sides say the same
          EXPECT_EQ(count_above(15, {-1, 0, 0}) > 0, count_above(15, {0, 0, 0}) > 0)
              << radius << " at " << x;
        }
      }
      EXPECT_FALSE(volume.Surface({}).triangles.empty()) << "the wall stays";
    }
  }
}

TEST(ExtractSurface, DrawsNothingWhereNobodyLooked) {
  SmallVolume volume = VolumeOf(Ball({0.3, 0.2, -0.4}, 21.3), 2);
  for (auto& [at, solution] : volume.solutions) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      if (16 * at.x + i % 16 >= 5) solution->support[i] = 0;
    }
  }
  const SurfacePiece half = volume.Surface({});
  EXPECT_GT(half.triangles.size(), 1000u);
  for (const VertexKey& key : half.keys) ASSERT_LT(key.x, 5);
  EXPECT_TRUE(volume.Surface({.near_maps_min = 6}).triangles.empty()) << "five maps were near";
  EXPECT_FALSE(volume.Surface({.near_maps_min = 5}).triangles.empty());
}

TEST(ExtractSurface, KeepsTrianglesWhereValuesAreZero) {
  const SmallVolume volume =
      VolumeOf([](const Eigen::Vector3d& at) { return std::round(at.z() - 3.5); }, 2);
  const SurfacePiece flat = volume.Surface({});
  EXPECT_EQ(flat.triangles.size(), 2u * 63 * 63);
  for (const auto& t : flat.triangles) {
    const Eigen::Vector3f a = flat.positions[t[0]], b = flat.positions[t[1]],
                          c = flat.positions[t[2]];
    ASSERT_GT((b - a).cross(c - a).z(), 1e-4f);
  }
}

TEST(ExtractSurface, RefusesWhatDoesNotFit) {
  const SolutionBlock solution;
  const VolumeGrid grid;
  const auto code = [&](std::vector<ExtractionBlock> blocks, const ExtractionOptions& options) {
    return ExtractSurface({0, 0, 0}, blocks, grid, options).status().code();
  };
  EXPECT_EQ(code({}, {}), StatusCode::kOk);
  EXPECT_EQ(code({{{9, 0, 0}, &solution}}, {}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{{0, 0, 0}, nullptr}}, {}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{{1, 0, 0}, &solution}, {{0, 0, 0}, &solution}}, {}),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(code({}, {.piece_extent_cells_min = 16}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({}, {.near_maps_min = 255}), StatusCode::kInvalidArgument);
}

TEST(SurfacePiece, SurvivesStorageAndRefusesHostileBytes) {
  const SurfacePiece piece = VolumeOf(Ball({0.3, 0.2, -0.4}, 9.3), 1).Surface({});
  const std::vector<uint8_t> bytes = Serialize(piece);
  EXPECT_EQ(ParseSurfacePiece(bytes).value(), piece);
  EXPECT_EQ(ParseSurfacePiece(Serialize(SurfacePiece())).value(), SurfacePiece());
  SeededRandom random(3);
  for (int i = 0; i < 200; ++i) {
    const size_t length = random.Below(static_cast<uint32_t>(bytes.size()));
    EXPECT_EQ(ParseSurfacePiece(std::span(bytes).first(length)).status().code(),
              StatusCode::kCorruption);
    std::vector<uint8_t> damaged = bytes;
    damaged[i < 9 ? i : random.Below(static_cast<uint32_t>(bytes.size()))] ^=
        static_cast<uint8_t>(1 + random.Below(255));
    const Result<SurfacePiece> parsed = ParseSurfacePiece(damaged);
    if (i < 9) {
      EXPECT_FALSE(parsed.ok());
    }
    if (!parsed.ok()) continue;
    EXPECT_EQ(Serialize(*parsed), damaged);
    for (const auto& t : parsed->triangles) {
      for (const uint32_t v : t) ASSERT_LT(v, parsed->keys.size());
    }
  }
}

TEST(SolutionBlock, SurvivesStorageAndRefusesHostileBytes) {
  const SmallVolume volume = VolumeOf(Ball({0.3, 0.2, -0.4}, 9.3), 1);
  const SolutionBlock& block = *volume.solutions.begin()->second;
  std::vector<uint8_t> bytes = Serialize(block);
  EXPECT_EQ(*ParseSolutionBlock(bytes).value(), block);
  EXPECT_EQ(ParseSolutionBlock(std::span(bytes).first(bytes.size() - 1)).status().code(),
            StatusCode::kCorruption);
  EXPECT_EQ(ParseSolutionBlock({}).status().code(), StatusCode::kCorruption);
  bytes[0] = 2;
  EXPECT_EQ(ParseSolutionBlock(bytes).status().code(), StatusCode::kCorruption);
  bytes[0] = 1;
  bytes[1] = 0, bytes[2] = 0x80;  // -32768
  EXPECT_EQ(ParseSolutionBlock(bytes).status().code(), StatusCode::kCorruption);
}

TEST(Grid, KnowsWhoReachesWhom) {
  EXPECT_EQ(FloorDivide(-1, 16), -1);
  EXPECT_EQ(FloorDivide(-16, 16), -1);
  EXPECT_EQ(FloorDivide(-17, 16), -2);
  EXPECT_EQ(FloorDivide(15, 16), 0);
  EXPECT_EQ(TileOf({-1, 4, 3}), (GridPlace{-1, 1, 0}));
  SeededRandom random(9);
  for (int i = 0; i < 100; ++i) {
    const auto coordinate = [&] { return static_cast<int32_t>(random.Below(41)) - 20; };
    const GridPlace block = {coordinate(), coordinate(), coordinate()};
    const std::vector<GridPlace> tiles = TilesThatReach(block);
    EXPECT_NE(std::find(tiles.begin(), tiles.end(), TileOf(block)), tiles.end());
    for (const GridPlace& tile : tiles) {
      const std::vector<GridPlace> reach = BlocksInReach(tile);
      EXPECT_TRUE(std::binary_search(reach.begin(), reach.end(), block));
    }
    const std::vector<GridPlace> own = BlocksOfTile(TileOf(block));
    EXPECT_TRUE(std::binary_search(own.begin(), own.end(), block));
    const bool is_corner = tiles.size() == 8, is_inner = tiles.size() == 1;
    EXPECT_TRUE(is_corner || is_inner || tiles.size() == 2 || tiles.size() == 4);
  }
  EXPECT_FALSE((VolumeGrid{0.05, 1}).Check().ok());
  EXPECT_FALSE((VolumeGrid{std::numeric_limits<double>::quiet_NaN(), 4}).Check().ok());
}

}  // namespace
}  // namespace veduta
