// SPDX-License-Identifier: Apache-2.0
#include "storage/records/pose_record.h"

#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

static_assert(sizeof(Observation) == 12);  // rows are copied as they lie (schema.capnp)

}  // namespace

Status Check(const PoseRecord& pose) {
  VEDUTA_RETURN_IF_ERROR(CheckId("pose's image", pose.image));
  VEDUTA_RETURN_IF_ERROR(CheckId("pose's reconstruction", pose.reconstruction));
  return CheckTransform(pose.cam_from_world.rotation, pose.cam_from_world.translation);
}

Result<std::string> Encode(const PoseRecord& pose) {
  VEDUTA_RETURN_IF_ERROR(Check(pose));
  return WriteMessage<schema::Pose>(0, [&](auto to) {
    to.setReconstruction(pose.reconstruction.value);
    Fill(to.initCamFromWorld(), pose.cam_from_world.rotation, pose.cam_from_world.translation);
  });
}

Status Decode(std::string_view value, ImageId image, PoseRecord* pose) {
  return ReadMessage<schema::Pose>(value, [&](schema::Pose::Reader from) {
    pose->image = image;
    pose->reconstruction = ReconstructionId(from.getReconstruction());
    Read(from.getCamFromWorld(), &pose->cam_from_world.rotation, &pose->cam_from_world.translation);
    return Damaged(Check(*pose));
  });
}

Status Check(std::span<const Observation> observations) {
  for (size_t i = 0; i < observations.size(); ++i) {
    const Observation& o = observations[i];
    VEDUTA_RETURN_IF_ERROR(CheckId("home of an observed point", o.point.home));
    if (o.point.ordinal == 0) return Broken("ordinal of an observed point", 0, "1 or more");
    if (i > 0 && o.feature <= observations[i - 1].feature)
      return Broken("observed feature", o.feature, "ascending");
  }
  return Status::Ok();
}

Result<std::string> Encode(std::span<const Observation> observations) {
  VEDUTA_RETURN_IF_ERROR(Check(observations));
  return WriteMessage<schema::Observations>(observations.size_bytes(), [&](auto to) {
    to.setRows(AsData(observations.data(), observations.size()));
  });
}

Status Decode(std::string_view value, std::vector<Observation>* observations) {
  return ReadMessage<schema::Observations>(value, [&](schema::Observations::Reader from) {
    if (!CopyRows(from.getRows(), observations)) return BadRows("observations");
    return Damaged(Check(std::span<const Observation>(*observations)));
  });
}

}  // namespace veduta
