// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/grid.h"

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr double kTruncationVoxelsMin = 2, kTruncationVoxelsMax = 8;

std::vector<GridPlace> BlocksAround(const GridPlace& tile, int32_t margin) {
  const GridPlace low = FirstBlock(tile);
  std::vector<GridPlace> blocks;
  for (int32_t x = -margin; x < kTileBlocks + margin; ++x) {
    for (int32_t y = -margin; y < kTileBlocks + margin; ++y) {
      for (int32_t z = -margin; z < kTileBlocks + margin; ++z)
        blocks.push_back({low.x + x, low.y + y, low.z + z});
    }
  }
  return blocks;
}

}  // namespace

std::vector<GridPlace> BlocksInReach(const GridPlace& tile) {
  return BlocksAround(tile, 1);
}

std::vector<GridPlace> BlocksOfTile(const GridPlace& tile) {
  return BlocksAround(tile, 0);
}

std::vector<GridPlace> TilesThatReach(const GridPlace& block) {
  const GridPlace own = TileOf(block);
  std::vector<GridPlace> tiles;
  for (int32_t x = -1; x <= 1; ++x) {
    for (int32_t y = -1; y <= 1; ++y) {
      for (int32_t z = -1; z <= 1; ++z) {
        const GridPlace tile = {own.x + x, own.y + y, own.z + z};
        if (IsInReach(block, tile)) tiles.push_back(tile);
      }
    }
  }
  return tiles;
}

Status VolumeGrid::Check() const {
  return OptionBounds()
      .FiniteAbove("voxel_size", voxel_size, 0)
      .Between("truncation_voxels", truncation_voxels, kTruncationVoxelsMin, kTruncationVoxelsMax)
      .status();
}

}  // namespace veduta
