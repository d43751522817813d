// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/dense_json.h"

namespace veduta {

Json ToJson(const DensifyReport& report) {
  return {{"reconstruction", report.reconstruction.value},
          {"device", report.device},
          {"voxel_size", report.voxel_size},
          {"depth_side_px", report.depth_side_px},
          {"sensor_count", report.sensor_count},
          {"without_depth", ToJson(report.without_depth)},
          {"depth_maps", ToJson(report.depths)},
          {"checks", ToJson(report.checks)},
          {"volume", ToJson(report.volume)},
          {"blocks_changed", report.volume.units},
          {"fusion", ToJson(report.solutions)},
          {"surface", ToJson(report.meshes)},
          {"exposures", ToJson(report.exposures)},
          {"colors", ToJson(report.colors)},
          {"tiles", report.tiles},
          {"vertices", report.vertices},
          {"triangles", report.triangles}};
}

Json ToJson(const StageCount& count) {
  return {{"computed", count.computed},
          {"kept", count.kept},
          {"removed", count.removed},
          {"ms", count.ms}};
}

Json ToJson(const PassedOver& photo) {
  return {{"id", photo.image.value}, {"image", photo.name}, {"reason", photo.reason}};
}

Json ToJson(const DeviceList& list) {
  Json devices = Json::array();
  for (const DeviceInfo& device : list.devices) {
    devices.push_back({{"index", device.index},
                       {"name", device.name},
                       {"platform", device.platform},
                       {"driver", device.driver_version},
                       {"kind", DeviceKindName(device.kind)},
                       {"compute_units", device.compute_units},
                       {"memory_bytes", device.memory_bytes},
                       {"chosen", list.chosen == device.index}});
  }
  return Json::object({{"devices", devices}});
}

Json ToJson(const ExportedModel& model) {
  return {{"reconstruction", model.reconstruction.value},
          {"folder", model.folder},
          {"images", model.images},
          {"points", model.points},
          {"vertices", model.vertices},
          {"triangles", model.triangles},
          {"on_earth", model.on_earth}};
}

Json ToJson(const RenderReport& report) {
  return {{"covered_share", report.covered_share},
          {"error_median", report.error_median},
          {"error_median_balanced", report.error_median_balanced}};
}

}  // namespace veduta
