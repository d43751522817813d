// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the volume's voxels lie, and how they are grouped: 16^3 voxels are a block, the unit of
// storage; 4^3 blocks are a tile, the unit of work. Voxel (i, j, k) has its centre at ((i + 0.5) s,
// (j + 0.5) s, (k + 0.5) s) of the reconstruction's frame, s being the voxel's edge.

#include <array>
#include <cstdint>
#include <vector>

#include "storage/base/option_fields.h"
#include "storage/base/status.h"
#include "storage/model/grid_place.h"

namespace veduta {

inline constexpr int32_t kBlockSide = 16;                                      // voxels
inline constexpr int32_t kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;  // 4096
inline constexpr int32_t kTileBlocks = 4;                                      // blocks a side
inline constexpr int32_t kTileSide = kTileBlocks * kBlockSide;                 // voxels
inline constexpr int32_t kBlockCoordinateMax = 1 << 24;  // of any block in use, either sign

// a / b rounded towards minus infinity; b > 0.
constexpr int32_t FloorDivide(int32_t a, int32_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

// Of a voxel within its block: x runs fastest, so a row of 16 voxels lies together.
constexpr size_t VoxelOffset(int32_t x, int32_t y, int32_t z) {
  return static_cast<size_t>((z * kBlockSide + y) * kBlockSide + x);
}

constexpr GridPlace TileOf(const GridPlace& block) {
  return {FloorDivide(block.x, kTileBlocks), FloorDivide(block.y, kTileBlocks),
          FloorDivide(block.z, kTileBlocks)};
}
// The tile's block of lowest coordinates.
constexpr GridPlace FirstBlock(const GridPlace& tile) {
  return {tile.x * kTileBlocks, tile.y * kTileBlocks, tile.z * kTileBlocks};
}
// Whether `block` is one of the tile's 4^3 own blocks; and whether it is one of these or of the
// halo, one block wide.
constexpr bool IsInTile(const GridPlace& block, const GridPlace& tile) {
  return TileOf(block) == tile;
}
constexpr bool IsInReach(const GridPlace& block, const GridPlace& tile) {
  const GridPlace low = FirstBlock(tile);
  const auto within = [](int32_t at, int32_t from) {
    return at >= from - 1 && at <= from + kTileBlocks;
  };
  return within(block.x, low.x) && within(block.y, low.y) && within(block.z, low.z);
}
// The 6^3 blocks that solving a tile reads, ascending; and the 4^3 that it writes.
std::vector<GridPlace> BlocksInReach(const GridPlace& tile);
std::vector<GridPlace> BlocksOfTile(const GridPlace& tile);
// The tiles whose reach holds `block`, ascending, its own among them: what to solve again when the
// block changed.
std::vector<GridPlace> TilesThatReach(const GridPlace& block);

struct VolumeGrid {
  double voxel_size = 0.05;  // > 0; world units
  double truncation_voxels =
      4;  // [2, 8]; distances are cut off there: several times the noise of depth, in voxels

  double truncation() const { return truncation_voxels * voxel_size; }  // world units
  Status Check() const;  // the first violated bound, with its value
};
VEDUTA_OPTION_FIELDS(VolumeGrid, voxel_size, truncation_voxels)

}  // namespace veduta
