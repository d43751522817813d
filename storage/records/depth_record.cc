// SPDX-License-Identifier: Apache-2.0
#include "storage/records/depth_record.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "storage/records/dense_entry.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

// Rows are copied as they lie (schema.capnp).
static_assert(sizeof(SeenBlock) == 16 && sizeof(DepthVersion) == 16 && sizeof(ImageId) == 4);
using PoseRow = std::array<double, 7>;

PoseRow RowOf(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

Rigid3 PoseOf(const PoseRow& row) {
  return {Eigen::Quaterniond(row[0], row[1], row[2], row[3]),
          Eigen::Vector3d(row[4], row[5], row[6])};
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
  return IsRigid(depth.cam_from_world.rotation, depth.cam_from_world.translation)
             ? Status::Ok()
             : Status::InvalidArgument("a depth map's pose is not rigid");
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
  Fill(to.initCamFromWorld(), depth.cam_from_world.rotation, depth.cam_from_world.translation);
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
  Read(from.getCamFromWorld(), &depth->cam_from_world.rotation, &depth->cam_from_world.translation);
}

}  // namespace

std::string DepthKey(ImageId image) {
  return DenseKey(DenseEntry::kDepth, image.value);
}

std::string CheckedDepthKey(ImageId image, uint64_t version) {
  std::string key = DenseKey(DenseEntry::kCheckedDepth, image.value);
  AppendBigEndian64(&key, version);
  return key;
}

Status ParseDenseKey(std::string_view key, ImageId* image) {
  key.remove_prefix(1);
  return TakeId(&key, image) && key.empty() ? Status::Ok() : WrongDenseKey();
}

Status ParseDenseKey(std::string_view key, ImageId* image, uint64_t* version) {
  key.remove_prefix(1);
  return TakeId(&key, image) && TakeBigEndian64(&key, version) && key.empty() ? Status::Ok()
                                                                              : WrongDenseKey();
}

Status Check(const DepthRecord& depth) {
  VEDUTA_RETURN_IF_ERROR(CheckGeometry(depth));
  for (const SensorPose& sensor : depth.sensors) {
    if (!sensor.image.valid() ||
        !IsRigid(sensor.cam_from_world.rotation, sensor.cam_from_world.translation)) {
      return Status::InvalidArgument("a sensor view without id, or with a pose that is not rigid");
    }
  }
  for (const float gain : depth.gain) {
    if (!(gain >= 0 && std::isfinite(gain)))
      return Status::InvalidArgument("a gain must be 0 or more");
  }
  return Status::Ok();
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

Status Check(const CheckedDepthRecord& depth) {
  VEDUTA_RETURN_IF_ERROR(CheckGeometry(depth));
  for (const DepthVersion& neighbor : depth.neighbors) {
    if (!neighbor.image.valid())
      return Status::InvalidArgument("a neighboring depth map of image 0");
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

Status Check(const DepthPixels& pixels) {
  if (pixels.codes.size() == pixels.confidence.size()) return Status::Ok();
  return Status::InvalidArgument(std::to_string(pixels.codes.size()) + " depths with " +
                                 std::to_string(pixels.confidence.size()) + " confidences");
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

}  // namespace veduta
