// SPDX-License-Identifier: Apache-2.0
// The fused signed distance of every tile, and its triangles. What a tile gets depends on the tiles
// around it: its version names theirs.
#include <algorithm>
#include <string>

#include "fusion/pass/stage.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/volume/solver.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// Of a tile's part that is made from the same part, named by `version_of`, of the 27 tiles around
// and with it.
template <typename StageOptions, typename VersionOfPart>
uint64_t VersionAround(const StageOptions& options, const std::string& part,
                       const TileRecords& tiles, GridPlace place, VersionOfPart&& version_of) {
  VersionFeed feed(options);
  feed << part;
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

// The two rounds of fusion/volume/solver.h. The first starts where the last pass ended; the second
// starts where the first ended and holds the halo's far side where the neighbours' first round has
// it.
struct Round {
  const char* name;
  SurfacePart start, result;
  uint64_t TileRecord::*made_from;  // of the 27 tiles
  uint64_t TileRecord::*version;
};
constexpr Round kFirstRound = {"first round", SurfacePart::kSolution, SurfacePart::kFirstRound,
                               &TileRecord::histogram_version, &TileRecord::first_round_version};
constexpr Round kSecondRound = {"solution", SurfacePart::kFirstRound, SurfacePart::kSolution,
                                &TileRecord::first_round_version, &TileRecord::solution_version};

// `tile` is what becomes of the record in `tiles`.
Status Solve(const FusionStageOptions& options, const Round& round, const TileRecords& tiles,
             const TileRecord& tile, DensePass* pass) {
  const auto snapshot = pass->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HistogramAt> histograms,
                          LoadHistograms(*snapshot, tiles, tile.place));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SolvedBlock> start,
                          LoadSolutions(*snapshot, tiles, tile.place, round.start));
  std::vector<TileBlock> blocks;
  for (const HistogramAt& block : histograms) {
    const auto found = std::ranges::find(start, block.index, &SolvedBlock::index);
    const SolutionBlock* previous = found == start.end() ? nullptr : found->solution.get();
    const bool is_border = &round == &kSecondRound && !IsInTile(block.index, tile.place);
    blocks.push_back(
        {block.index, block.histogram.get(), previous, is_border ? previous : nullptr});
  }
  const Result<TileSolution> solution =
      SolveTile(tile.place, blocks, options.solver, pass->device(), pass->pool(), pass->stop());
  if (solution.status().code() == StatusCode::kCancelled) return pass->CheckStop();
  VEDUTA_RETURN_IF_ERROR(solution.status());
  const std::vector<uint8_t> bytes = SerializeSolution(solution->blocks);
  const auto write = [&](const Snapshot&, Transaction* transaction) {
    transaction->dense().PutSurface(round.result, tile.reconstruction, tile.place, bytes);
    transaction->dense().PutTile(tile);
    return Status::Ok();
  };
  return pass->CommitTile(tiles.at(tile.place), tile.place, write);
}

// Solves the tiles whose version of this round is stale, `looked_at` of 2 x tiles before it.
Status SolveRound(const FusionStageOptions& options, const Round& round, size_t looked_at,
                  DensePass* pass, TileRecords* tiles, StageCount* count) {
  for (auto& [place, tile] : *tiles) {
    VEDUTA_RETURN_IF_ERROR(pass->Tell("fusion", looked_at++, 2 * tiles->size()));
    const uint64_t version = VersionAround(options, round.name, *tiles, place,
                                           [&](const TileRecord& t) { return t.*round.made_from; });
    if (tile.*round.version == version) {
      ++count->kept;
      continue;
    }
    TileRecord solved = tile;
    solved.*round.version = version;
    VEDUTA_RETURN_IF_ERROR(Solve(options, round, *tiles, solved, pass));
    tile = solved;
    ++count->computed;
  }
  return Status::Ok();
}

// A tile's triangles, made beside those of other tiles.
struct Extraction {
  TileRecord tile;
  Result<SurfacePiece> piece = Status::Cancelled("not extracted");
};

Result<SurfacePiece> Extract(const MeshStageOptions& options, const Snapshot& snapshot,
                             const TileRecords& tiles, GridPlace place) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SolvedBlock> solved,
                          LoadSolutions(snapshot, tiles, place));
  std::vector<ExtractionBlock> blocks;
  for (const SolvedBlock& block : solved) blocks.push_back({block.index, block.solution.get()});
  return ExtractSurface(place, blocks, options.grid, options.extraction);
}

Status Commit(const TileRecord& as_read, Extraction* extraction, DensePass* pass) {
  VEDUTA_RETURN_IF_ERROR(extraction->piece.status());
  TileRecord& tile = extraction->tile;
  const SurfacePiece& piece = *extraction->piece;
  tile.triangle_count = piece.triangles.size();
  tile.vertex_count = piece.keys.size();
  const std::vector<uint8_t> bytes = Serialize(piece);
  return pass->CommitTile(as_read, tile.place, [&](const Snapshot&, Transaction* transaction) {
    transaction->dense().PutSurface(SurfacePart::kMesh, tile.reconstruction, tile.place, bytes);
    transaction->dense().PutTile(tile);
    return Status::Ok();
  });
}

}  // namespace

Result<StageCount> SolveTiles(const FusionStageOptions& options, DensePass* pass) {
  Stopwatch watch;
  StageCount count;
  VEDUTA_ASSIGN_OR_RETURN(TileRecords tiles,
                          LoadTileRecords(*pass->GetSnapshot(), pass->surface()));
  StageCount first;
  VEDUTA_RETURN_IF_ERROR(SolveRound(options, kFirstRound, 0, pass, &tiles, &first));
  VEDUTA_RETURN_IF_ERROR(SolveRound(options, kSecondRound, tiles.size(), pass, &tiles, &count));
  VEDUTA_RETURN_IF_ERROR(pass->Tell("fusion", 2 * tiles.size(), 2 * tiles.size()));
  count.ms = watch.LapMs();
  return count;
}

Result<StageCount> ExtractTiles(const MeshStageOptions& options, DensePass* pass) {
  Stopwatch watch;
  StageCount count;
  const auto snapshot = pass->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadTileRecords(*snapshot, pass->surface()));
  std::vector<Extraction> stale;
  for (const auto& [place, tile] : tiles) {
    const uint64_t version = VersionAround(options, "mesh", tiles, place,
                                           [](const TileRecord& t) { return t.solution_version; });
    if (tile.mesh_version == version) {
      ++count.kept;
      continue;
    }
    stale.push_back({tile});
    stale.back().tile.mesh_version = version;
  }
  const size_t together = pass->pool().thread_count() + 1;
  for (size_t first = 0; first < stale.size(); first += together) {
    VEDUTA_RETURN_IF_ERROR(pass->Tell("surface", count.kept + first, tiles.size()));
    const size_t last = std::min(stale.size(), first + together);
    pass->pool().ParallelFor(last - first, [&](size_t i) {
      stale[first + i].piece = Extract(options, *snapshot, tiles, stale[first + i].tile.place);
    });
    for (size_t i = first; i < last; ++i) {
      VEDUTA_RETURN_IF_ERROR(Commit(tiles.at(stale[i].tile.place), &stale[i], pass));
      stale[i].piece = Status::Cancelled("committed");  // gives back its memory
      ++count.computed;
    }
  }
  VEDUTA_RETURN_IF_ERROR(pass->Tell("surface", tiles.size(), tiles.size()));
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
