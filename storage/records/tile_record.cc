// SPDX-License-Identifier: Apache-2.0
#include "storage/records/tile_record.h"

#include "storage/records/dense_entry.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

static_assert(sizeof(DepthVersion) == 16);  // rows are copied as they lie (schema.capnp)

// Signed numbers sort as unsigned ones once the sign bit is turned.
void AppendPlace(GridPlace place, std::string* key) {
  for (const int32_t c : {place.x, place.y, place.z})
    AppendBigEndian32(key, static_cast<uint32_t>(c) ^ 0x80000000u);
}

bool TakePlace(std::string_view* key, GridPlace* place) {
  for (int32_t* c : {&place->x, &place->y, &place->z}) {
    uint32_t value = 0;
    if (!TakeBigEndian32(key, &value)) return false;
    *c = static_cast<int32_t>(value ^ 0x80000000u);
  }
  return true;
}

}  // namespace

std::string TilePrefix(ReconstructionId reconstruction) {
  return DenseKey(DenseEntry::kTile, reconstruction.value);
}

std::string TileKey(ReconstructionId reconstruction, GridPlace place) {
  std::string key = TilePrefix(reconstruction);
  AppendPlace(place, &key);
  return key;
}

Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction, GridPlace* place) {
  key.remove_prefix(1);
  return TakeId(&key, reconstruction) && TakePlace(&key, place) && key.empty() ? Status::Ok()
                                                                               : WrongDenseKey();
}

std::string VolumePrefix(ReconstructionId reconstruction) {
  return Key32(reconstruction.value);
}

std::string VolumePrefix(ReconstructionId reconstruction, GridPlace tile) {
  std::string key = VolumePrefix(reconstruction);
  AppendPlace(tile, &key);
  return key;
}

std::string VolumeKey(ReconstructionId reconstruction, GridPlace tile, uint8_t block) {
  std::string key = VolumePrefix(reconstruction, tile);
  key.push_back(static_cast<char>(block));
  return key;
}

std::string SurfacePrefix(SurfacePart part, ReconstructionId reconstruction) {
  return TaggedKey(static_cast<uint8_t>(part), Key32(reconstruction.value));
}

std::string SurfaceKey(SurfacePart part, ReconstructionId reconstruction, GridPlace tile) {
  std::string key = SurfacePrefix(part, reconstruction);
  AppendPlace(tile, &key);
  return key;
}

Status Check(const TileRecord& tile) {
  if (!tile.reconstruction.valid()) return Status::InvalidArgument("a tile of reconstruction 0");
  for (size_t i = 0; i < tile.depths.size(); ++i) {
    const DepthVersion& depth = tile.depths[i];
    if (!depth.image.valid() || depth.reserved != 0 || (i > 0 && !(tile.depths[i - 1] < depth))) {
      return Status::InvalidArgument("a tile's depth maps do not ascend, or one has id 0");
    }
  }
  return Status::Ok();
}

Result<std::string> Encode(const TileRecord& tile) {
  VEDUTA_RETURN_IF_ERROR(Check(tile));
  return WriteMessage<schema::Tile>(tile.depths.size() * sizeof(DepthVersion), [&](auto to) {
    to.setBlocks(tile.blocks);
    to.setDepths(AsData(tile.depths));
    to.setVolumeVersion(tile.volume_version);
    to.setHistogramVersion(tile.histogram_version);
    to.setFirstRoundVersion(tile.first_round_version);
    to.setSolutionVersion(tile.solution_version);
    to.setMeshVersion(tile.mesh_version);
    to.setColorVersion(tile.color_version);
    to.setTriangleCount(tile.triangle_count);
    to.setVertexCount(tile.vertex_count);
  });
}

Status Decode(std::string_view value, TileRecord* tile) {
  return ReadMessage<schema::Tile>(value, [&](schema::Tile::Reader from) {
    tile->blocks = from.getBlocks();
    if (!CopyRows(from.getDepths(), &tile->depths)) return BadRows("depths");
    tile->volume_version = from.getVolumeVersion();
    tile->histogram_version = from.getHistogramVersion();
    tile->first_round_version = from.getFirstRoundVersion();
    tile->solution_version = from.getSolutionVersion();
    tile->mesh_version = from.getMeshVersion();
    tile->color_version = from.getColorVersion();
    tile->triangle_count = from.getTriangleCount();
    tile->vertex_count = from.getVertexCount();
    return Damaged(Check(*tile));
  });
}

}  // namespace veduta
