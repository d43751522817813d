// SPDX-License-Identifier: Apache-2.0
#include "storage/records/dense_settings.h"

#include <cmath>

#include "storage/records/dense_entry.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string DenseSettingsKey(ReconstructionId reconstruction) {
  return DenseKey(DenseEntry::kSettings, reconstruction.value);
}

Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction) {
  key.remove_prefix(1);
  return TakeId(&key, reconstruction) && key.empty() ? Status::Ok() : WrongDenseKey();
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

}  // namespace veduta
