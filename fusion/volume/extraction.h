// SPDX-License-Identifier: Apache-2.0
#pragma once
// The surface u = 0 of one tile, by marching cubes. A cell has eight voxel centres as corners and
// belongs to the tile of its lowest one, so every cell is drawn once; a vertex lies on the edge
// between two voxel centres, and its place depends on these two voxels (its normal on theirs)
// alone, so neighbouring tiles compute the same bytes: no cracks. Source: Lorensen and Cline,
// SIGGRAPH 1987, with a table that is consistent across faces (marching_cubes.h).

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/volume/grid.h"
#include "fusion/volume/solution.h"
#include "storage/base/option_fields.h"
#include "storage/base/status.h"

namespace veduta {

// Part of the version of every tile's mesh: raise it whenever a change of the code changes what
// ExtractSurface returns (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kExtractionVersion = 1;

struct ExtractionOptions {
  uint32_t near_maps_min =
      2;  // [0, 254]; on either side of the surface a cell's corner was near it in so many
  uint32_t piece_extent_cells_min =
      15;  // [0, 15]; connected pieces that fit into fewer cells along all axes go

  Status Check() const;  // the first violated bound, named with its value
};
VEDUTA_OPTION_FIELDS(ExtractionOptions, near_maps_min, piece_extent_cells_min)

// The edge that a vertex lies on: from the voxel (x, y, z) to the next one along `axis` (0: x, 1:
// y, 2: z).
struct VertexKey {
  int32_t x = 0, y = 0, z = 0, axis = 0;
  auto operator<=>(const VertexKey&) const = default;
};

// A tile's own triangles; as arrays of their own, for TriangleMesh is a floor above. Vertices on a
// border are in both tiles' pieces, with the same key, place and normal.
struct SurfacePiece {
  std::vector<VertexKey> keys;             // ascending, each once
  std::vector<Eigen::Vector3f> positions;  // one for each key; frame of the reconstruction
  std::vector<Eigen::Vector3f> normals;    // one for each key; unit, towards free space
  std::vector<uint8_t>
      near_maps;  // one for each key; how many maps saw surface there, the lesser of both voxels
  std::vector<std::array<uint32_t, 3>>
      triangles;  // indices of keys, counter-clockwise seen from free space

  bool operator==(const SurfacePiece& other) const = default;
};

// One block of the tile or of its halo that is solved.
struct ExtractionBlock {
  GridPlace index;
  const SolutionBlock* solution = nullptr;  // never null
};

// A cell is drawn if somebody saw all its corners (but for two at most, whose neighbours' mean
// stands in) and, on either side of the surface, near_maps_min maps were near one. Then pieces
// (connected by vertices) that fit into under `piece_extent_cells_min` cells along every axis are
// dropped. The halo shows such a piece as a whole to every tile that owns a part of it, so all drop
// it, or none.
//
// Deterministic; thread-safe; single-threaded; O(voxels), about 10 ms. kInvalidArgument on blocks
// out of reach, out of order or without a solution, or bad options.
Result<SurfacePiece> ExtractSurface(const GridPlace& tile, std::span<const ExtractionBlock> blocks,
                                    const VolumeGrid& grid, const ExtractionOptions& options);

// One mesh of all pieces, vertices of equal keys once, in the order of their keys; triangles in the
// order of the pieces. Positions and normals take 24 bytes for each vertex: for what fits into
// memory.
SurfacePiece WeldPieces(std::span<const SurfacePiece* const> pieces);

// piece = version:u8 (1), vertices:u32, triangles:u32, then for each vertex key (i32 x, y, z, u8
// axis), position (f32 x3), normal (f32 x3), near_maps:u8, and for each triangle u32 x3;
// little-endian. Parse: kCorruption on a wrong size, keys out of order, values that are not finite
// or indices out of range.
std::vector<uint8_t> Serialize(const SurfacePiece& piece);
Result<SurfacePiece> ParseSurfacePiece(std::span<const uint8_t> bytes);

}  // namespace veduta
