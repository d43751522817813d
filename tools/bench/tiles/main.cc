// SPDX-License-Identifier: Apache-2.0
// Gives the largest reconstruction of a database a made-up surface instead of the one that it has:
// hills over a square of tiles, in the records that a dense pass writes; and made-up points on
// these hills beside its own, in the records that the mapper writes. No image observes them: the
// database is for serving and drawing alone.
//   veduta-bench-tiles DB --triangles 5000000 --points 5000000 --extent 8
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "engine/parts.h"
#include "engine/query/living.h"
#include "fusion/pass/tile_parts.h"

namespace veduta::bench {
namespace {

constexpr uint32_t kTrianglesOfTile = 2 * kTileSide * kTileSide;

// Voxels above the lowest of the tiles of z 0, within one of these.
double HeightAt(double x, double y) {
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

struct Square {
  int32_t side = 0;       // tiles
  double voxel_size = 0;  // in the reconstruction's unit
};

Status FillSurface(Writer& writer, const ReconstructionRecord& record, const Square& square) {
  const auto [side, voxel_size] = square;
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

// A point that looks as the surface does below it, seen by the block's home and by `other`.
PointRecord PointOnHills(const PointBlock& block, ImageId other, const Square& square,
                         std::mt19937_64* random) {
  const double half = 0.5 * square.side * kTileSide;  // voxels
  std::uniform_real_distribution<double> place(-half, half);
  const double x = place(*random), y = place(*random), height = HeightAt(x, y);
  PointRecord point;
  point.id = {block.home, block.next_ordinal};
  point.position = square.voxel_size * Eigen::Vector3d(x, y, height);
  point.rgb = {static_cast<uint8_t>(90 + 2 * height),
               static_cast<uint8_t>(120 + 60 * std::sin(x / 100.0)),
               static_cast<uint8_t>(120 + 60 * std::sin(y / 130.0))};
  point.error_px = 0.5F;
  point.track = {{std::min(block.home, other), 0}, {std::max(block.home, other), 0}};
  return point;
}

// One commit per block, so that no more than one is in memory.
Status FillPoints(Writer& writer, ReconstructionRecord record, uint64_t points,
                  const Square& square) {
  std::vector<PointBlock> blocks;
  VEDUTA_RETURN_IF_ERROR(writer.GetSnapshot()->ScanPointBlocks(record.id, record.points_generation,
                                                               [&](const PointBlock& block) {
                                                                 blocks.push_back(block);
                                                                 return true;
                                                               }));
  if (blocks.size() < 2) return Status::InvalidArgument("two images with points are needed");
  std::mt19937_64 random(1);
  for (size_t i = 0; i < blocks.size(); ++i) {
    PointBlock& block = blocks[i];
    const ImageId other = blocks[i == 0 ? 1 : 0].home;
    const uint64_t count = points * (i + 1) / blocks.size() - points * i / blocks.size();
    for (uint64_t k = 0; k < count; ++k, ++block.next_ordinal)
      block.points.push_back(PointOnHills(block, other, square, &random));
    record.point_count += count;
    record.observation_count += 2 * count;
    record.reprojection_error_px_sum += 0.5 * 2 * static_cast<double>(count);
    Writer::Turn turn = writer.Take();
    const auto transaction = turn.database().BeginTransaction();
    transaction->PutPointBlock(record.id, record.points_generation, block);
    transaction->PutReconstruction(record);
    VEDUTA_RETURN_IF_ERROR(transaction->Commit());
    block.points = {};
  }
  std::printf("%llu points in %zu blocks\n", static_cast<unsigned long long>(record.point_count),
              blocks.size());
  return Status::Ok();
}

Status Fill(const std::string& path, uint64_t triangles, uint64_t points, double extent) {
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine, Engine::Open(path));
  Writer& writer = *EngineParts::Of(*engine).writer;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, LargestLiving(*writer.GetSnapshot()));
  Square square;
  square.side =
      static_cast<int32_t>(std::ceil(std::sqrt(static_cast<double>(triangles) / kTrianglesOfTile)));
  square.voxel_size = extent / (square.side * kTileSide);
  VEDUTA_RETURN_IF_ERROR(FillSurface(writer, record, square));
  return points == 0 ? Status::Ok() : FillPoints(writer, record, points, square);
}

}  // namespace
}  // namespace veduta::bench

int main(int argc, char** argv) {
  CLI::App app("Gives a reconstruction a made-up surface and made-up points.");
  std::string path;
  uint64_t triangles = 5'000'000, points = 0;
  double extent = 8;
  app.add_option("DB", path, "The database")->required();
  app.add_option("--triangles", triangles, "At least so many")->check(CLI::Range(1, 1'000'000'000));
  app.add_option("--points", points, "So many beside its own")->check(CLI::Range(0, 100'000'000));
  app.add_option("--extent", extent, "Side of the square, in the reconstruction's unit")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  const veduta::Status filled = veduta::bench::Fill(path, triangles, points, extent);
  if (!filled.ok()) std::fprintf(stderr, "%s\n", filled.message().c_str());
  return filled.ok() ? 0 : 1;
}
