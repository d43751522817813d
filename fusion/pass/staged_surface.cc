// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/staged_surface.h"

#include <map>
#include <string>

#include "fusion/pass/tile_parts.h"

namespace veduta {
namespace {

struct SurfaceCounts {
  uint64_t tiles = 0, triangles = 0;
};

Result<SurfaceCounts> CountTiles(const Snapshot& snapshot, ReconstructionId surface) {
  SurfaceCounts counts;
  VEDUTA_RETURN_IF_ERROR(snapshot.dense().ScanTiles(surface, [&](const TileRecord& tile) {
    ++counts.tiles;
    counts.triangles += tile.triangle_count;
    return true;
  }));
  return counts;
}

// What is stored of a tile beside its record.
struct TileParts {
  std::map<uint8_t, StoredBytes> blocks;
  std::map<SurfacePart, StoredBytes> surface;
};

Result<TileParts> ReadParts(const Snapshot& snapshot, const TileRecord& tile) {
  TileParts parts;
  for (uint8_t number = 0; number < kTileBlockCount; ++number) {
    if (!(tile.blocks & (1ull << number))) continue;
    VEDUTA_ASSIGN_OR_RETURN(parts.blocks[number], snapshot.dense().GetVolumeBlock(
                                                      tile.reconstruction, tile.place, number));
  }
  for (const SurfacePart part : {SurfacePart::kSolution, SurfacePart::kMesh, SurfacePart::kColors,
                                 SurfacePart::kFirstRound}) {
    Result<StoredBytes> bytes = snapshot.dense().GetSurface(part, tile.reconstruction, tile.place);
    if (bytes.status().code() == StatusCode::kNotFound) continue;  // a tile without triangles
    VEDUTA_RETURN_IF_ERROR(bytes.status());
    parts.surface[part] = std::move(*bytes);
  }
  return parts;
}

// Everything of a tile, from one id to another, in one transaction. A tile that is damaged is
// deleted instead: the next stages make it again, and no pass could ever move it.
Status MoveTile(const Snapshot& snapshot, TileRecord tile, ReconstructionId to,
                DenseWriter* writer) {
  const Result<TileParts> parts = ReadParts(snapshot, tile);
  const StatusCode code = parts.status().code();
  const bool is_damaged = code == StatusCode::kCorruption || code == StatusCode::kNotFound;
  if (!parts.ok() && !is_damaged) return parts.status();
  writer->DeleteTile(tile.reconstruction, tile.place);
  if (!parts.ok()) return Status::Ok();
  for (const auto& [number, bytes] : parts->blocks)
    writer->PutVolumeBlock(to, tile.place, number, bytes.bytes());
  for (const auto& [part, bytes] : parts->surface)
    writer->PutSurface(part, to, tile.place, bytes.bytes());
  tile.reconstruction = to;
  writer->PutTile(tile);
  return Status::Ok();
}

Status DeleteSurface(ReconstructionId surface, DensePass* pass) {
  return pass->Commit([&](const Snapshot&, Transaction* transaction) {
    transaction->dense().DeleteReconstruction(surface);
    return Status::Ok();
  });
}

}  // namespace

Result<ReconstructionId> BeginSurface(const DenseSettings& settings, DensePass* pass) {
  const ReconstructionId own = pass->reconstruction(), staged = StagedSurfaceOf(own);
  const auto snapshot = pass->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const auto last, snapshot->dense().FindSettings(own));
  VEDUTA_ASSIGN_OR_RETURN(const auto begun, snapshot->dense().FindSettings(staged));
  VEDUTA_ASSIGN_OR_RETURN(const SurfaceCounts old, CountTiles(*snapshot, own));
  const bool is_beside = last && last->voxel_size != settings.voxel_size && old.tiles > 0;
  const bool goes_on = begun && is_beside && begun->voxel_size == settings.voxel_size;
  DenseSettings stored = settings;
  stored.reconstruction = is_beside ? staged : own;
  const ReconstructionId surface = stored.reconstruction;
  if (goes_on ? *begun == stored : !begun && !is_beside && last && *last == stored) return surface;
  VEDUTA_RETURN_IF_ERROR(pass->Commit([&](const Snapshot&, Transaction* transaction) {
    if (begun && !goes_on) transaction->dense().DeleteReconstruction(staged);
    transaction->dense().PutSettings(stored);
    return Status::Ok();
  }));
  return surface;
}

Status SwitchToStaged(DensePass* pass) {
  const ReconstructionId own = pass->reconstruction(), staged = pass->surface();
  if (staged == own) return Status::Ok();
  const auto snapshot = pass->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(auto settings, snapshot->dense().FindSettings(staged));
  VEDUTA_ASSIGN_OR_RETURN(const SurfaceCounts made, CountTiles(*snapshot, staged));
  VEDUTA_ASSIGN_OR_RETURN(const SurfaceCounts old, CountTiles(*snapshot, own));
  if (!settings) return Status::Corruption("the staged surface has lost its settings");
  if (made.triangles == 0 && old.triangles > 0) {
    VEDUTA_RETURN_IF_ERROR(DeleteSurface(staged, pass));
    return Status::InvalidArgument(
        "a voxel size of " + std::to_string(settings->voxel_size) +
        " gives no surface at all, so the former surface stays: give --voxel another size");
  }
  return pass->Commit([&](const Snapshot&, Transaction* transaction) {
    transaction->dense().DeleteReconstruction(own);
    settings->reconstruction = own;
    transaction->dense().PutSettings(*settings);
    return Status::Ok();
  });
}

Status FinishMove(DensePass* pass) {
  const ReconstructionId own = pass->reconstruction(), staged = StagedSurfaceOf(own);
  const auto snapshot = pass->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const bool moves, IsMoving(*snapshot, own));
  if (!moves) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadTileRecords(*snapshot, staged));
  size_t done = 0;
  for (const auto& [place, tile] : tiles) {
    VEDUTA_RETURN_IF_ERROR(pass->Tell("switch", done++, tiles.size()));
    VEDUTA_RETURN_IF_ERROR(
        pass->Commit([&, &tile = tile](const Snapshot& now, Transaction* transaction) {
          return MoveTile(now, tile, own, &transaction->dense());
        }));
  }
  VEDUTA_RETURN_IF_ERROR(DeleteSurface(staged, pass));
  return pass->Tell("switch", tiles.size(), tiles.size());
}

}  // namespace veduta
