// SPDX-License-Identifier: Apache-2.0
// Gives the largest reconstruction of a database a made-up surface instead of the one that it has:
// hills over a square of tiles, in the records that a dense pass writes.
//   veduta-bench-tiles DB --triangles 5000000 --extent 8
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "engine/parts.h"
#include "engine/query/living.h"
#include "fusion/pass/tile_parts.h"

namespace veduta::bench {
namespace {

constexpr uint32_t kTrianglesOfTile = 2 * kTileSide * kTileSide;

// Voxels above the lowest of the tiles of z 0, within one of these.
double HeightAt(int32_t x, int32_t y) {
  return 32 + 18 * std::sin(x / 61.0) * std::cos(y / 47.0) + 6 * std::sin(x / 9.0 + y / 13.0);
}

SurfacePiece HillsOf(const GridPlace& tile, double voxel_size) {
  SurfacePiece piece;
  const GridPlace first = FirstBlock(tile);
  for (int32_t i = 0; i <= kTileSide; ++i) {  // keys ascend by x, then y
    for (int32_t j = 0; j <= kTileSide; ++j) {
      const int32_t x = first.x * kBlockSide + i, y = first.y * kBlockSide + j;
      const double height = HeightAt(x, y);
      piece.keys.push_back({x, y, static_cast<int32_t>(height), 2});
      piece.positions.push_back(
          (voxel_size * Eigen::Vector3d(x + 0.5, y + 0.5, height + 0.5)).cast<float>());
      piece.normals.emplace_back(0, 0, 1);
      piece.near_maps.push_back(3);
    }
  }
  for (uint32_t i = 0; i < kTileSide; ++i) {
    for (uint32_t j = 0; j < kTileSide; ++j) {
      const uint32_t a = i * (kTileSide + 1) + j, c = a + kTileSide + 1;
      piece.triangles.push_back({a, c, c + 1});
      piece.triangles.push_back({a, c + 1, a + 1});
    }
  }
  return piece;
}

uint64_t BlocksOf(const SurfacePiece& piece, const GridPlace& tile) {
  uint64_t blocks = 0;
  for (const VertexKey& key : piece.keys) {
    const GridPlace block = {FloorDivide(key.x, kBlockSide), FloorDivide(key.y, kBlockSide),
                             FloorDivide(key.z, kBlockSide)};
    if (IsInTile(block, tile)) blocks |= uint64_t{1} << NumberInTile(block);
  }
  return blocks;
}

std::vector<std::array<uint8_t, 3>> PaintOf(const SurfacePiece& piece) {
  std::vector<std::array<uint8_t, 3>> colors;
  for (const VertexKey& key : piece.keys) {
    const bool is_line = key.x % 32 == 0 || key.y % 32 == 0;
    colors.push_back({static_cast<uint8_t>(is_line ? 30 : 90 + 2 * key.z),
                      static_cast<uint8_t>(120 + 60 * std::sin(key.x / 100.0)),
                      static_cast<uint8_t>(120 + 60 * std::sin(key.y / 130.0))});
  }
  return colors;
}

void PutTile(ReconstructionId id, const GridPlace& place, double voxel_size,
             Transaction* transaction) {
  const SurfacePiece piece = HillsOf(place, voxel_size);
  TileRecord tile;
  tile.reconstruction = id;
  tile.place = place;
  tile.blocks = BlocksOf(piece, place);
  tile.mesh_version = tile.color_version = 1;
  tile.triangle_count = piece.triangles.size();
  tile.vertex_count = piece.keys.size();
  DenseWriter& dense = transaction->dense();
  dense.PutTile(tile);
  dense.PutSurface(SurfacePart::kMesh, id, place, Serialize(piece));
  dense.PutSurface(SurfacePart::kColors, id, place,
                   SerializeColors(tile.mesh_version, PaintOf(piece),
                                   std::vector<uint8_t>(piece.keys.size(), 3)));
}

Status Fill(const std::string& path, uint64_t triangles, double extent) {
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine, Engine::Open(path));
  Writer& writer = *EngineParts::Of(*engine).writer;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, LargestLiving(*writer.GetSnapshot()));
  const auto side =
      static_cast<int32_t>(std::ceil(std::sqrt(static_cast<double>(triangles) / kTrianglesOfTile)));
  const double voxel_size = extent / (side * kTileSide);
  for (int32_t x = -side / 2; x < side - side / 2; ++x) {
    Writer::Turn turn = writer.Take();
    const auto transaction = turn.database().BeginTransaction();
    if (x == -side / 2) {
      transaction->dense().DeleteReconstruction(record.id);
      transaction->dense().PutSettings({record.id, voxel_size, 512, 2});
    }
    for (int32_t y = -side / 2; y < side - side / 2; ++y)
      PutTile(record.id, {x, y, 0}, voxel_size, transaction.get());
    VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  }
  std::printf("%d tiles, %lld triangles, voxels of %g\n", side * side,
              static_cast<long long>(side) * side * kTrianglesOfTile, voxel_size);
  return Status::Ok();
}

}  // namespace
}  // namespace veduta::bench

int main(int argc, char** argv) {
  CLI::App app("Gives a reconstruction a made-up surface.");
  std::string path;
  uint64_t triangles = 5'000'000;
  double extent = 8;
  app.add_option("DB", path, "The database")->required();
  app.add_option("--triangles", triangles, "At least so many")->check(CLI::Range(1, 1'000'000'000));
  app.add_option("--extent", extent, "Side of the square, in the reconstruction's unit")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  const veduta::Status filled = veduta::bench::Fill(path, triangles, extent);
  if (!filled.ok()) std::fprintf(stderr, "%s\n", filled.message().c_str());
  return filled.ok() ? 0 : 1;
}
