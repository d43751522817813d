// SPDX-License-Identifier: Apache-2.0
#include "storage/records/camera_record.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "storage/model/awaited_photos.h"
#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string CameraKey(CameraId id) {
  return Key32(id.value);
}

Status Check(const CameraRecord& camera) {
  VEDUTA_RETURN_IF_ERROR(CheckId("camera", camera.id));
  const CameraModel &m = camera.model, &extraction = camera.extraction_model();
  if (camera.refined_from) {
    CameraModel alike = m;
    alike.fx = extraction.fx, alike.fy = extraction.fy;
    alike.k1 = extraction.k1, alike.k2 = extraction.k2;
    if (alike != extraction)
      return Status::InvalidArgument("refined_from differs by more than fx, fy, k1 and k2");
    if (extraction.fx == 0) return Status::InvalidArgument("refined_from has no focal length");
  }
  return CheckFinite({{"fx", m.fx},
                      {"fy", m.fy},
                      {"cx", m.cx},
                      {"cy", m.cy},
                      {"k1", m.k1},
                      {"k2", m.k2},
                      {"u0", m.u0},
                      {"v0", m.v0},
                      {"refined_from fx", extraction.fx},
                      {"refined_from fy", extraction.fy},
                      {"refined_from k1", extraction.k1},
                      {"refined_from k2", extraction.k2},
                      {"told_focal_share", camera.told_focal_share},
                      {"focal_stddev_share", camera.focal_stddev_share}});
}

Result<std::string> Encode(const CameraRecord& camera) {
  VEDUTA_RETURN_IF_ERROR(Check(camera));
  const AwaitedPhotos* const awaited = camera.awaited.get();
  const size_t hashes = awaited != nullptr ? awaited->photos.size() + 1 : 0;
  const size_t payload = camera.name.size() + camera.source.size() + sizeof(ContentHash) * hashes;
  return WriteMessage<schema::Camera>(payload, [&](auto to) {
    to.setName(AsText(camera.name));
    to.setSource(AsText(camera.source));
    to.setWidthPx(camera.model.width_px);
    to.setHeightPx(camera.model.height_px);
    to.setFx(camera.model.fx);
    to.setFy(camera.model.fy);
    to.setCx(camera.model.cx);
    to.setCy(camera.model.cy);
    to.setK1(camera.model.k1);
    to.setK2(camera.model.k2);
    to.setU0(camera.model.u0);
    to.setV0(camera.model.v0);
    to.setIsRefinable(camera.is_refinable);
    to.setToldFocalShare(camera.told_focal_share);
    to.setFocalStddevShare(camera.focal_stddev_share);
    to.setVersion(camera.version);
    if (camera.refined_from) {
      to.setRefinedFromFx(camera.refined_from->fx);
      to.setRefinedFromFy(camera.refined_from->fy);
      to.setRefinedFromK1(camera.refined_from->k1);
      to.setRefinedFromK2(camera.refined_from->k2);
    }
    if (awaited == nullptr) return;
    to.setAwaitedPhotos(AsData(awaited->photos));
    to.setAwaitedList(AsData(&awaited->list, 1));
  });
}

Status Decode(std::string_view value, CameraId id, CameraRecord* camera) {
  return ReadMessage<schema::Camera>(value, [&](schema::Camera::Reader from) {
    camera->id = id;
    camera->name = FromText(from.getName());
    camera->source = FromText(from.getSource());
    camera->model = {from.getWidthPx(), from.getHeightPx(), from.getFx(), from.getFy(),
                     from.getCx(),      from.getCy(),       from.getK1(), from.getK2(),
                     from.getU0(),      from.getV0()};
    camera->is_refinable = from.getIsRefinable();
    camera->told_focal_share = from.getToldFocalShare();
    camera->focal_stddev_share = from.getFocalStddevShare();
    camera->version = std::max(1u, from.getVersion());  // older programs leave it out
    camera->refined_from.reset();
    if (from.getRefinedFromFx() != 0) {
      CameraModel& refined_from = camera->refined_from.emplace(camera->model);
      refined_from.fx = from.getRefinedFromFx(), refined_from.fy = from.getRefinedFromFy();
      refined_from.k1 = from.getRefinedFromK1(), refined_from.k2 = from.getRefinedFromK2();
    }
    const auto awaited = std::make_shared<AwaitedPhotos>();
    if (!CopyRows(from.getAwaitedPhotos(), &awaited->photos)) return BadRows("awaited_photos");
    std::vector<ContentHash> list;
    if (!CopyRows(from.getAwaitedList(), &list) || list.size() > 1) return BadRows("awaited_list");
    if (!list.empty()) awaited->list = list.front();
    camera->awaited = list.empty() ? nullptr : awaited;
    return Damaged(Check(*camera));
  });
}

}  // namespace veduta
