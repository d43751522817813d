// SPDX-License-Identifier: Apache-2.0
#include "storage/dense_codec.h"

#include <algorithm>
#include <cmath>

#include "storage/keys.h"
#include "storage/message.h"
#include "storage/schema.capnp.h"

namespace veduta {
namespace {

static_assert(sizeof(GridPlace) == 12 && sizeof(SeenBlock) == 16 && sizeof(DepthVersion) == 16 &&
              sizeof(ImageId) == 4);

constexpr double kUnitNormSlack = 1e-3;
using PoseRow = std::array<double, 7>;

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

std::string Tagged(uint8_t tag, uint32_t id) {
  std::string key(1, static_cast<char>(tag));
  AppendBigEndian32(&key, id);
  return key;
}
std::string Tagged(DenseEntry entry, uint32_t id) {
  return Tagged(static_cast<uint8_t>(entry), id);
}

Status WrongKey() {
  return Status::Corruption("a key of wrong length, or with id 0");
}

template <typename Id>
bool TakeId(std::string_view* key, Id* id) {
  return TakeBigEndian32(key, &id->value) && id->valid();
}

PoseRow RowOf(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}
Rigid3 PoseOf(const PoseRow& row) {
  return {Eigen::Quaterniond(row[0], row[1], row[2], row[3]),
          Eigen::Vector3d(row[4], row[5], row[6])};
}

bool IsRigid(const Rigid3& pose) {
  return std::abs(pose.rotation.norm() - 1) < kUnitNormSlack && pose.translation.allFinite();
}

template <typename Record>
Status CheckGeometry(const Record& depth) {
  if (!depth.image.valid() || !depth.reconstruction.valid())
    return Status::InvalidArgument("depth map with an id 0");
  if (depth.width_px == 0 || depth.height_px == 0 || depth.width_px > 65535 ||
      depth.height_px > 65535) {
    return Status::InvalidArgument("depth map of " + std::to_string(depth.width_px) + "x" +
                                   std::to_string(depth.height_px) + " px; a side has 1 to 65535");
  }
  if (!(depth.fx > 0 && depth.fy > 0 && std::isfinite(depth.fx + depth.fy + depth.cx + depth.cy))) {
    return Status::InvalidArgument("a depth map's camera is not a pinhole");
  }
  if (!(depth.depth_near > 0 && depth.depth_far > depth.depth_near &&
        std::isfinite(depth.depth_far))) {
    return Status::InvalidArgument("depth range from " + std::to_string(depth.depth_near) + " to " +
                                   std::to_string(depth.depth_far) +
                                   " must be positive and ascend");
  }
  return IsRigid(depth.cam_from_world) ? Status::Ok()
                                       : Status::InvalidArgument("a depth map's pose is not rigid");
}

Status Check(const DenseSettings& settings) {
  if (!settings.reconstruction.valid())
    return Status::InvalidArgument("dense settings of reconstruction 0");
  if (!(settings.voxel_size > 0 && std::isfinite(settings.voxel_size))) {
    return Status::InvalidArgument("voxel size " + std::to_string(settings.voxel_size) +
                                   " must be above 0");
  }
  return settings.sensor_count > 0
             ? Status::Ok()
             : Status::InvalidArgument("a key view has 1 sensor view or more");
}

Status Check(const DepthRecord& depth) {
  VEDUTA_RETURN_IF_ERROR(CheckGeometry(depth));
  for (const SensorPose& sensor : depth.sensors) {
    if (!sensor.image.valid() || !IsRigid(sensor.cam_from_world)) {
      return Status::InvalidArgument("a sensor view without id, or with a pose that is not rigid");
    }
  }
  for (const float gain : depth.gain) {
    if (!(gain >= 0 && std::isfinite(gain)))
      return Status::InvalidArgument("a gain must be 0 or more");
  }
  return Status::Ok();
}

Status Check(const CheckedDepthRecord& depth) {
  VEDUTA_RETURN_IF_ERROR(CheckGeometry(depth));
  for (const DepthVersion& neighbor : depth.neighbors) {
    if (!neighbor.image.valid())
      return Status::InvalidArgument("a neighbouring depth map of image 0");
  }
  const auto not_above = [](const SeenBlock& a, const SeenBlock& b) {
    return !(a.place < b.place);
  };
  if (std::adjacent_find(depth.blocks.begin(), depth.blocks.end(), not_above) ==
      depth.blocks.end()) {
    return Status::Ok();
  }
  return Status::InvalidArgument("a depth map's blocks do not ascend");
}

Status Check(const DepthPixels& pixels) {
  if (pixels.codes.size() == pixels.confidence.size()) return Status::Ok();
  return Status::InvalidArgument(std::to_string(pixels.codes.size()) + " depths with " +
                                 std::to_string(pixels.confidence.size()) + " confidences");
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

Status Damaged(const Status& check) {
  return check.ok() ? check : Status::Corruption(check.message());
}
Status BadRows(const char* column) {
  return Status::Corruption(std::string(column) + " has a broken row");
}

template <typename Record>
void FillGeometry(const Record& depth, schema::DepthGeometry::Builder to) {
  to.setWidthPx(depth.width_px);
  to.setHeightPx(depth.height_px);
  to.setFx(depth.fx);
  to.setFy(depth.fy);
  to.setCx(depth.cx);
  to.setCy(depth.cy);
  to.setDepthNear(depth.depth_near);
  to.setDepthFar(depth.depth_far);
  schema::Rigid::Builder pose = to.initCamFromWorld();
  const PoseRow row = RowOf(depth.cam_from_world);
  pose.setQw(row[0]);
  pose.setQx(row[1]);
  pose.setQy(row[2]);
  pose.setQz(row[3]);
  pose.setTx(row[4]);
  pose.setTy(row[5]);
  pose.setTz(row[6]);
}

template <typename Record>
void ReadGeometry(schema::DepthGeometry::Reader from, Record* depth) {
  depth->width_px = from.getWidthPx();
  depth->height_px = from.getHeightPx();
  depth->fx = from.getFx();
  depth->fy = from.getFy();
  depth->cx = from.getCx();
  depth->cy = from.getCy();
  depth->depth_near = from.getDepthNear();
  depth->depth_far = from.getDepthFar();
  const schema::Rigid::Reader p = from.getCamFromWorld();
  depth->cam_from_world =
      PoseOf({p.getQw(), p.getQx(), p.getQy(), p.getQz(), p.getTx(), p.getTy(), p.getTz()});
}

}  // namespace

std::string DenseSettingsKey(ReconstructionId reconstruction) {
  return Tagged(DenseEntry::kSettings, reconstruction.value);
}
std::string DepthKey(ImageId image) {
  return Tagged(DenseEntry::kDepth, image.value);
}
std::string CheckedDepthKey(ImageId image, uint64_t version) {
  std::string key = Tagged(DenseEntry::kCheckedDepth, image.value);
  AppendBigEndian64(&key, version);
  return key;
}
std::string TilePrefix(ReconstructionId reconstruction) {
  return Tagged(DenseEntry::kTile, reconstruction.value);
}
std::string TileKey(ReconstructionId reconstruction, GridPlace place) {
  std::string key = TilePrefix(reconstruction);
  AppendPlace(place, &key);
  return key;
}
std::string VolumePrefix(ReconstructionId reconstruction) {
  return ReconstructionKey(reconstruction);
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
  return Tagged(static_cast<uint8_t>(part), reconstruction.value);
}
std::string SurfaceKey(SurfacePart part, ReconstructionId reconstruction, GridPlace tile) {
  std::string key = SurfacePrefix(part, reconstruction);
  AppendPlace(tile, &key);
  return key;
}

Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction) {
  key.remove_prefix(1);
  return TakeId(&key, reconstruction) && key.empty() ? Status::Ok() : WrongKey();
}
Status ParseDenseKey(std::string_view key, ImageId* image) {
  key.remove_prefix(1);
  return TakeId(&key, image) && key.empty() ? Status::Ok() : WrongKey();
}
Status ParseDenseKey(std::string_view key, ImageId* image, uint64_t* version) {
  key.remove_prefix(1);
  return TakeId(&key, image) && TakeBigEndian64(&key, version) && key.empty() ? Status::Ok()
                                                                              : WrongKey();
}
Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction, GridPlace* place) {
  key.remove_prefix(1);
  return TakeId(&key, reconstruction) && TakePlace(&key, place) && key.empty() ? Status::Ok()
                                                                               : WrongKey();
}

Result<std::string> Encode(const DenseSettings& settings) {
  VEDUTA_RETURN_IF_ERROR(Check(settings));
  return WriteMessage<schema::DenseSettings>(0, [&](auto to) {
    to.setVoxelSize(settings.voxel_size);
    to.setDepthSidePx(settings.depth_side_px);
    to.setSensorCount(settings.sensor_count);
  });
}

Status Decode(std::string_view value, DenseSettings* settings) {
  return ReadMessage<schema::DenseSettings>(value, [&](schema::DenseSettings::Reader from) {
    settings->voxel_size = from.getVoxelSize();
    settings->depth_side_px = from.getDepthSidePx();
    settings->sensor_count = from.getSensorCount();
    return Damaged(Check(*settings));
  });
}

Result<std::string> Encode(const DepthRecord& depth) {
  VEDUTA_RETURN_IF_ERROR(Check(depth));
  std::vector<ImageId> images;
  std::vector<PoseRow> poses;
  for (const SensorPose& sensor : depth.sensors) {
    images.push_back(sensor.image);
    poses.push_back(RowOf(sensor.cam_from_world));
  }
  return WriteMessage<schema::Depth>(
      poses.size() * sizeof(PoseRow) + images.size() * sizeof(ImageId), [&](auto to) {
        to.setReconstruction(depth.reconstruction.value);
        to.setVersion(depth.version);
        to.setGeometryVersion(depth.geometry_version);
        FillGeometry(depth, to.initGeometry());
        to.setSensors(AsData(images));
        to.setSensorPoses(AsData(poses));
        to.setKnownCount(depth.known_count);
        to.setCheckedVersion(depth.checked_version);
        to.setGain(AsData(depth.gain.data(), depth.gain.size()));
        to.setExposureVersion(depth.exposure_version);
      });
}

Status Decode(std::string_view value, DepthRecord* depth) {
  return ReadMessage<schema::Depth>(value, [&](schema::Depth::Reader from) {
    depth->reconstruction = ReconstructionId(from.getReconstruction());
    depth->version = from.getVersion();
    depth->geometry_version = from.getGeometryVersion();
    ReadGeometry(from.getGeometry(), depth);
    std::vector<ImageId> images;
    std::vector<PoseRow> poses;
    if (!CopyRows(from.getSensors(), &images)) return BadRows("sensors");
    if (!CopyRows(from.getSensorPoses(), &poses) || poses.size() != images.size())
      return BadRows("sensorPoses");
    depth->sensors.clear();
    for (size_t i = 0; i < images.size(); ++i)
      depth->sensors.push_back({images[i], PoseOf(poses[i])});
    depth->known_count = from.getKnownCount();
    depth->checked_version = from.getCheckedVersion();
    std::vector<std::array<float, 3>> gain;
    if (!CopyRows(from.getGain(), &gain) || gain.size() != 1) return BadRows("gain");
    depth->gain = gain.front();
    depth->exposure_version = from.getExposureVersion();
    return Damaged(Check(*depth));
  });
}

Result<std::string> Encode(const CheckedDepthRecord& depth) {
  VEDUTA_RETURN_IF_ERROR(Check(depth));
  return WriteMessage<schema::CheckedDepth>(
      depth.blocks.size() * sizeof(SeenBlock) + depth.neighbors.size() * sizeof(DepthVersion),
      [&](auto to) {
        to.setReconstruction(depth.reconstruction.value);
        FillGeometry(depth, to.initGeometry());
        to.setKnownCount(depth.known_count);
        to.setBlocks(AsData(depth.blocks));
        to.setNeighbors(AsData(depth.neighbors));
      });
}

Status Decode(std::string_view value, CheckedDepthRecord* depth) {
  return ReadMessage<schema::CheckedDepth>(value, [&](schema::CheckedDepth::Reader from) {
    depth->reconstruction = ReconstructionId(from.getReconstruction());
    ReadGeometry(from.getGeometry(), depth);
    depth->known_count = from.getKnownCount();
    if (!CopyRows(from.getBlocks(), &depth->blocks)) return BadRows("blocks");
    if (!CopyRows(from.getNeighbors(), &depth->neighbors)) return BadRows("neighbors");
    return Damaged(Check(*depth));
  });
}

Result<std::string> Encode(const DepthPixels& pixels) {
  VEDUTA_RETURN_IF_ERROR(Check(pixels));
  return WriteMessage<schema::DepthPixels>(pixels.codes.size() * 3, [&](auto to) {
    to.setCodes(AsData(pixels.codes));
    to.setConfidence(AsData(pixels.confidence));
  });
}

Status Decode(std::string_view value, DepthPixels* pixels) {
  return ReadMessage<schema::DepthPixels>(value, [&](schema::DepthPixels::Reader from) {
    if (!CopyRows(from.getCodes(), &pixels->codes)) return BadRows("codes");
    if (!CopyRows(from.getConfidence(), &pixels->confidence)) return BadRows("confidence");
    return Damaged(Check(*pixels));
  });
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
