// SPDX-License-Identifier: Apache-2.0
#pragma once
// Blocks and surfaces of tiles, in and out of the database.

#include <map>
#include <memory>
#include <vector>

#include "fusion/volume/extraction.h"
#include "fusion/volume/histogram.h"
#include "fusion/volume/solution.h"
#include "storage/database.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

// The number of a block in its tile, as in storage/dense.h.
uint8_t NumberInTile(const GridPlace& block);

// The records of a reconstruction's tiles, by place.
using TileRecords = std::map<GridPlace, TileRecord>;
Result<TileRecords> LoadTileRecords(const Snapshot& snapshot, ReconstructionId reconstruction);
// Those of the surface that readers see, also while it moves (fusion/pass/staged_surface.h). Their
// `reconstruction` says under which id their parts are stored.
Result<TileRecords> LoadCurrentTiles(const Snapshot& snapshot, ReconstructionId reconstruction);

// Leaves `count_max` maps where there are more: those whose images' numbers have the lowest hashes,
// whichever others there are; ascending.
void KeepSome(size_t count_max, std::vector<DepthVersion>* depths);

// Histograms of all allocated blocks that solving the tile reads, ascending.
struct HistogramAt {
  GridPlace index;
  std::unique_ptr<HistogramBlock> histogram;
};
Result<std::vector<HistogramAt>> LoadHistograms(const Snapshot& snapshot, const TileRecords& tiles,
                                                GridPlace tile);

// Solutions (kSolution, or kFirstRound) of all solved blocks in reach of the tile, ascending.
Result<std::vector<SolvedBlock>> LoadSolutions(const Snapshot& snapshot, const TileRecords& tiles,
                                               GridPlace tile,
                                               SurfacePart part = SurfacePart::kSolution);

// A tile's solved blocks as one value: count:u8, then for each its number:u8 and its bytes
// (fusion/volume/solution.h).
std::vector<uint8_t> SerializeSolution(std::span<const SolvedBlock> blocks);

// A tile's surface. Colours are empty where it is not coloured yet, or not for this mesh.
struct TileSurface {
  SurfacePiece piece;
  std::vector<std::array<uint8_t, 3>> colors;
};
// kNotFound when the tile has no mesh yet.
Result<TileSurface> LoadSurface(const Snapshot& snapshot, const TileRecord& tile);
TriangleMesh MeshOf(TileSurface surface);
// colours = version of the mesh:u64, then r, g, b, views:u8 for each vertex.
std::vector<uint8_t> SerializeColors(uint64_t mesh_version,
                                     std::span<const std::array<uint8_t, 3>> colors,
                                     std::span<const uint8_t> view_counts);

}  // namespace veduta
