// SPDX-License-Identifier: Apache-2.0
// Goal: voxels, blocks and tiles name each other rightly, on both sides of 0.
// Method: every block around the origin by brute force against the definitions.
#include "fusion/volume/grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace veduta {
namespace {

TEST(Grid, EveryBlockIsInOneTileAndInReachOfThoseAround) {
  for (int32_t x = -9; x <= 9; x += 3) {
    for (int32_t y = -5; y <= 5; ++y) {
      const GridPlace block{x, y, -4};
      const GridPlace tile = TileOf(block), first = FirstBlock(tile);
      EXPECT_TRUE(IsInTile(block, tile));
      EXPECT_LE(first.x, x);
      EXPECT_LT(x, first.x + kTileBlocks);
      const std::vector<GridPlace> own = BlocksOfTile(tile), reach = BlocksInReach(tile);
      EXPECT_EQ(own.size(), 64u);
      EXPECT_EQ(reach.size(), 216u);
      EXPECT_TRUE(std::ranges::is_sorted(own));
      EXPECT_TRUE(std::ranges::is_sorted(reach));
      EXPECT_TRUE(std::ranges::binary_search(own, block));
      EXPECT_TRUE(
          std::ranges::all_of(reach, [&](const GridPlace& b) { return IsInReach(b, tile); }));
    }
  }
}

TEST(Grid, TilesThatReachAreThoseWhoseReachHoldsTheBlock) {
  for (const GridPlace block : {GridPlace{0, 0, 0}, GridPlace{-1, 3, 4}, GridPlace{1, 2, -6}}) {
    std::vector<GridPlace> expected;
    for (int32_t x = -3; x <= 3; ++x) {
      for (int32_t y = -3; y <= 3; ++y) {
        for (int32_t z = -3; z <= 3; ++z) {
          if (IsInReach(block, {x, y, z})) expected.push_back({x, y, z});
        }
      }
    }
    EXPECT_EQ(TilesThatReach(block), expected);
  }
}

TEST(Grid, VoxelsOfABlockHaveOffsetsOfTheirOwn) {
  std::set<size_t> offsets;
  for (int32_t z = 0; z < kBlockSide; ++z) {
    for (int32_t y = 0; y < kBlockSide; ++y) {
      for (int32_t x = 0; x < kBlockSide; ++x) offsets.insert(VoxelOffset(x, y, z));
    }
  }
  EXPECT_EQ(offsets.size(), static_cast<size_t>(kBlockVoxels));
  EXPECT_EQ(*offsets.rbegin(), static_cast<size_t>(kBlockVoxels - 1));
  EXPECT_EQ(VoxelOffset(1, 0, 0), 1u) << "x runs fastest";
}

TEST(Grid, FloorDivideRoundsDown) {
  EXPECT_EQ(FloorDivide(-1, 4), -1);
  EXPECT_EQ(FloorDivide(-4, 4), -1);
  EXPECT_EQ(FloorDivide(-5, 4), -2);
  EXPECT_EQ(FloorDivide(3, 4), 0);
  EXPECT_EQ(FloorDivide(4, 4), 1);
}

TEST(Grid, ChecksItsOptions) {
  EXPECT_TRUE(VolumeGrid().Check().ok());
  EXPECT_FALSE(VolumeGrid{.voxel_size = 0}.Check().ok());
  EXPECT_FALSE((VolumeGrid{.voxel_size = 1, .truncation_voxels = 1}).Check().ok());
}

}  // namespace
}  // namespace veduta
