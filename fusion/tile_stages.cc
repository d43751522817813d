// SPDX-License-Identifier: Apache-2.0
// The fused signed distance of every tile, and its triangles. What a tile gets depends on the tiles around it: its
// version names theirs.
#include <algorithm>
#include <string>

#include "engine/stopwatch.h"
#include "fusion/pass.h"
#include "fusion/tile_parts.h"
#include "fusion/volume/solver.h"

namespace veduta {
namespace {

// Of a tile's part that is made from the same part, named by `version_of`, of the 27 tiles around and with it.
template <typename VersionOfPart>
uint64_t VersionAround(const std::string& stage, const TileRecords& tiles, GridPlace place,
                       VersionOfPart&& version_of) {
  VersionFeed feed(stage);
  for (int32_t x = place.x - 1; x <= place.x + 1; ++x) {
    for (int32_t y = place.y - 1; y <= place.y + 1; ++y) {
      for (int32_t z = place.z - 1; z <= place.z + 1; ++z) {
        const auto tile = tiles.find({x, y, z});
        feed << (tile == tiles.end() ? uint64_t{0} : version_of(tile->second));
      }
    }
  }
  return feed.Version();
}

Status Solve(const Pass& pass, const TileRecords& tiles, TileRecord tile) {
  const auto snapshot = pass.database.GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HistogramAt> histograms, LoadHistograms(*snapshot, tiles, tile.place));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SolvedBlock> previous, LoadSolutions(*snapshot, tiles, tile.place));
  std::vector<TileBlock> blocks;
  for (const HistogramAt& block : histograms) {
    const auto start = std::ranges::find(previous, block.index, &SolvedBlock::index);
    blocks.push_back({block.index, block.histogram.get(), start == previous.end() ? nullptr : start->solution.get()});
  }
  VEDUTA_ASSIGN_OR_RETURN(const TileSolution solution,
                          SolveTile(TileAt(tile.place), blocks, SolverOptions(), pass.device, pass.pool));
  const auto transaction = pass.database.BeginTransaction();
  transaction->dense().PutSurface(SurfacePart::kSolution, tile.reconstruction, tile.place,
                                  SerializeSolution(solution.blocks));
  transaction->dense().PutTile(tile);
  return transaction->Commit();
}

// A tile's triangles, made beside those of other tiles.
struct Extraction {
  TileRecord tile;
  Result<SurfacePiece> piece = Status::Cancelled("not extracted");
};

Result<SurfacePiece> Extract(const Pass& pass, const Snapshot& snapshot, const TileRecords& tiles, GridPlace place) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SolvedBlock> solved, LoadSolutions(snapshot, tiles, place));
  std::vector<ExtractionBlock> blocks;
  for (const SolvedBlock& block : solved) blocks.push_back({block.index, block.solution.get()});
  return ExtractSurface(TileAt(place), blocks, pass.grid(), ExtractionOptions());
}

Status Commit(const Pass& pass, Extraction* extraction) {
  VEDUTA_RETURN_IF_ERROR(extraction->piece.status());
  TileRecord& tile = extraction->tile;
  const SurfacePiece& piece = *extraction->piece;
  tile.triangle_count = piece.triangles.size();
  tile.vertex_count = piece.keys.size();
  const auto transaction = pass.database.BeginTransaction();
  transaction->dense().PutSurface(SurfacePart::kMesh, tile.reconstruction, tile.place, Serialize(piece));
  transaction->dense().PutTile(tile);
  return transaction->Commit();
}

}  // namespace

Result<StageCount> SolveTiles(const Pass& pass) {
  Stopwatch watch;
  StageCount count;
  VEDUTA_ASSIGN_OR_RETURN(TileRecords tiles,
                          LoadTileRecords(*pass.database.GetSnapshot(), pass.scene.reconstruction.id));
  size_t done = 0;
  for (auto& [place, tile] : tiles) {
    VEDUTA_RETURN_IF_ERROR(pass.Tell("fusion", done++, tiles.size()));
    const uint64_t version =
        VersionAround("solution", tiles, place, [](const TileRecord& t) { return t.volume_version; });
    if (tile.solution_version == version) {
      ++count.kept;
      continue;
    }
    TileRecord solved = tile;
    solved.solution_version = version;
    VEDUTA_RETURN_IF_ERROR(Solve(pass, tiles, solved));
    tile = solved;
    ++count.computed;
  }
  VEDUTA_RETURN_IF_ERROR(pass.Tell("fusion", done, tiles.size()));
  count.ms = watch.LapMs();
  return count;
}

Result<StageCount> ExtractTiles(const Pass& pass) {
  Stopwatch watch;
  StageCount count;
  const auto snapshot = pass.database.GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadTileRecords(*snapshot, pass.scene.reconstruction.id));
  std::vector<Extraction> stale;
  for (const auto& [place, tile] : tiles) {
    const uint64_t version =
        VersionAround("mesh", tiles, place, [](const TileRecord& t) { return t.solution_version; });
    if (tile.mesh_version == version) {
      ++count.kept;
      continue;
    }
    stale.push_back({tile});
    stale.back().tile.mesh_version = version;
  }
  const size_t together = pass.pool.thread_count() + 1;
  for (size_t first = 0; first < stale.size(); first += together) {
    VEDUTA_RETURN_IF_ERROR(pass.Tell("surface", count.kept + first, tiles.size()));
    const size_t last = std::min(stale.size(), first + together);
    pass.pool.ParallelFor(last - first, [&](size_t i) {
      stale[first + i].piece = Extract(pass, *snapshot, tiles, stale[first + i].tile.place);
    });
    for (size_t i = first; i < last; ++i) {
      VEDUTA_RETURN_IF_ERROR(Commit(pass, &stale[i]));
      stale[i].piece = Status::Cancelled("committed");  // gives back its memory
      ++count.computed;
    }
  }
  VEDUTA_RETURN_IF_ERROR(pass.Tell("surface", tiles.size(), tiles.size()));
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
