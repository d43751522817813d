// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/tile_parts.h"

#include <algorithm>
#include <cstring>

#include "fusion/pass/surface_settings.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr size_t kColorRow = 4;  // r, g, b, views

// Calls visit(block) on the allocated blocks in reach of a tile, ascending, until it fails.
template <typename Visit>
Status VisitReach(const TileRecords& tiles, GridPlace place, Visit&& visit) {
  for (const GridPlace& block : BlocksInReach(place)) {
    const auto tile = tiles.find(TileOf(block));
    if (tile == tiles.end() || !(tile->second.blocks >> NumberInTile(block) & 1)) continue;
    VEDUTA_RETURN_IF_ERROR(visit(block, tile->second));
  }
  return Status::Ok();
}

using SolvedTile = std::map<uint8_t, std::unique_ptr<SolutionBlock>>;

Result<SolvedTile> ParseSolution(std::span<const uint8_t> bytes) {
  const size_t count = bytes.empty() ? 0 : bytes[0];
  const size_t row = count == 0 ? 0 : (bytes.size() - 1) / count;
  if (bytes.empty() || (count > 0 && (row < 2 || row * count != bytes.size() - 1))) {
    return Status::Corruption("a tile's solution of " + std::to_string(bytes.size()) + " bytes");
  }
  SolvedTile blocks;
  for (size_t i = 0; i < count; ++i) {
    const std::span<const uint8_t> one = bytes.subspan(1 + i * row, row);
    VEDUTA_ASSIGN_OR_RETURN(blocks[one[0]], ParseSolutionBlock(one.subspan(1)));
  }
  return blocks;
}

}  // namespace

uint8_t NumberInTile(const GridPlace& block) {
  const GridPlace first = FirstBlock(TileOf(block));
  return static_cast<uint8_t>(block.x - first.x + 4 * (block.y - first.y) +
                              16 * (block.z - first.z));
}

Result<TileRecords> LoadTileRecords(const Snapshot& snapshot, ReconstructionId reconstruction) {
  TileRecords tiles;
  VEDUTA_RETURN_IF_ERROR(snapshot.dense().ScanTiles(reconstruction, [&](const TileRecord& tile) {
    tiles[tile.place] = tile;
    return true;
  }));
  return tiles;
}

Result<TileRecords> LoadCurrentTiles(const Snapshot& snapshot, ReconstructionId reconstruction) {
  VEDUTA_ASSIGN_OR_RETURN(TileRecords tiles, LoadTileRecords(snapshot, reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(const bool moves, IsMoving(snapshot, reconstruction));
  if (!moves) return tiles;
  VEDUTA_ASSIGN_OR_RETURN(TileRecords others,
                          LoadTileRecords(snapshot, StagedSurfaceOf(reconstruction)));
  tiles.merge(others);
  return tiles;
}

void KeepSome(size_t count_max, std::vector<DepthVersion>* depths) {
  if (depths->size() > count_max) {
    const auto hash = [](const DepthVersion& depth) { return MixSeed(depth.image.value, 0); };
    std::ranges::nth_element(*depths, depths->begin() + static_cast<ptrdiff_t>(count_max), {},
                             hash);
    depths->resize(count_max);
  }
  std::ranges::sort(*depths);
}

Result<std::vector<HistogramAt>> LoadHistograms(const Snapshot& snapshot, const TileRecords& tiles,
                                                GridPlace tile) {
  std::vector<HistogramAt> blocks;
  VEDUTA_RETURN_IF_ERROR(
      VisitReach(tiles, tile, [&](const GridPlace& block, const TileRecord& owner) -> Status {
        VEDUTA_ASSIGN_OR_RETURN(const StoredBytes bytes,
                                snapshot.dense().GetVolumeBlock(owner.reconstruction, owner.place,
                                                                NumberInTile(block)));
        VEDUTA_ASSIGN_OR_RETURN(std::unique_ptr<HistogramBlock> histogram,
                                ParseHistogramBlock(bytes.bytes()));
        blocks.push_back({block, std::move(histogram)});
        return Status::Ok();
      }));
  return blocks;
}

Result<std::vector<SolvedBlock>> LoadSolutions(const Snapshot& snapshot, const TileRecords& tiles,
                                               GridPlace tile, SurfacePart part) {
  std::map<GridPlace, SolvedTile> solved;
  std::vector<SolvedBlock> blocks;
  VEDUTA_RETURN_IF_ERROR(
      VisitReach(tiles, tile, [&](const GridPlace& block, const TileRecord& owner) -> Status {
        const bool is_last = part == SurfacePart::kSolution;
        if ((is_last ? owner.solution_version : owner.first_round_version) == 0)
          return Status::Ok();
        if (!solved.contains(owner.place)) {
          VEDUTA_ASSIGN_OR_RETURN(
              const StoredBytes bytes,
              snapshot.dense().GetSurface(part, owner.reconstruction, owner.place));
          VEDUTA_ASSIGN_OR_RETURN(solved[owner.place], ParseSolution(bytes.bytes()));
        }
        // A block allocated since then has none yet.
        std::unique_ptr<SolutionBlock>& solution = solved[owner.place][NumberInTile(block)];
        if (solution) blocks.push_back({block, std::move(solution)});
        return Status::Ok();
      }));
  return blocks;
}

std::vector<uint8_t> SerializeSolution(std::span<const SolvedBlock> blocks) {
  std::vector<uint8_t> bytes = {static_cast<uint8_t>(blocks.size())};
  for (const SolvedBlock& block : blocks) {
    bytes.push_back(NumberInTile(block.index));
    const std::vector<uint8_t> one = Serialize(*block.solution);
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  return bytes;
}

Result<TileSurface> LoadSurface(const Snapshot& snapshot, const TileRecord& tile) {
  TileSurface surface;
  const DenseReader& dense = snapshot.dense();
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes bytes,
                          dense.GetSurface(SurfacePart::kMesh, tile.reconstruction, tile.place));
  VEDUTA_ASSIGN_OR_RETURN(surface.piece, ParseSurfacePiece(bytes.bytes()));
  const Result<StoredBytes> stored =
      dense.GetSurface(SurfacePart::kColors, tile.reconstruction, tile.place);
  if (!stored.ok())
    return stored.status().code() == StatusCode::kNotFound ? Result(std::move(surface))
                                                           : stored.status();
  std::span<const uint8_t> colors = stored->bytes();
  uint64_t mesh_version = 0;
  if (colors.size() < sizeof(mesh_version))
    return Status::Corruption("a tile's colours are cut short");
  std::memcpy(&mesh_version, colors.data(), sizeof(mesh_version));
  if (mesh_version != tile.mesh_version) return surface;
  colors = colors.subspan(sizeof(mesh_version));
  if (colors.size() != surface.piece.keys.size() * kColorRow) {
    return Status::Corruption("a tile of " + std::to_string(surface.piece.keys.size()) +
                              " vertices has " + std::to_string(colors.size()) +
                              " bytes of colour");
  }
  for (size_t i = 0; i < colors.size(); i += kColorRow)
    surface.colors.push_back({colors[i], colors[i + 1], colors[i + 2]});
  return surface;
}

TriangleMesh MeshOf(TileSurface surface) {
  return {std::move(surface.piece.positions), std::move(surface.piece.normals),
          std::move(surface.colors), std::move(surface.piece.triangles)};
}

std::vector<uint8_t> SerializeColors(uint64_t mesh_version,
                                     std::span<const std::array<uint8_t, 3>> colors,
                                     std::span<const uint8_t> view_counts) {
  std::vector<uint8_t> bytes(sizeof(mesh_version));
  std::memcpy(bytes.data(), &mesh_version, sizeof(mesh_version));
  bytes.reserve(bytes.size() + colors.size() * kColorRow);
  for (size_t i = 0; i < colors.size(); ++i) {
    bytes.insert(bytes.end(), colors[i].begin(), colors[i].end());
    bytes.push_back(view_counts[i]);
  }
  return bytes;
}

}  // namespace veduta
