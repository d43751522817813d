// SPDX-License-Identifier: Apache-2.0
#include "storage/records/reconstruction_record.h"

#include <cmath>

#include "storage/records/earth_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string ReconstructionKey(ReconstructionId id) {
  return Key32(id.value);
}

Status Check(const ReconstructionRecord& reconstruction) {
  VEDUTA_RETURN_IF_ERROR(CheckId("reconstruction", reconstruction.id));
  if (reconstruction.merged_into == reconstruction.id) {
    return Broken("merged_into", reconstruction.id.value, "another reconstruction");
  }
  const Sim3& s = reconstruction.merged_from_this;
  if (!(std::isfinite(s.scale) && s.scale > 0))
    return Broken("scale of merged_from_this", s.scale, "finite and above 0");
  VEDUTA_RETURN_IF_ERROR(CheckTransform(s.rotation, s.translation));
  VEDUTA_RETURN_IF_ERROR(Check(reconstruction.georeference));
  return CheckFinite({{"reprojection_error_px_sum", reconstruction.reprojection_error_px_sum}});
}

Result<std::string> Encode(const ReconstructionRecord& reconstruction) {
  VEDUTA_RETURN_IF_ERROR(Check(reconstruction));
  constexpr size_t kPlaceBytes = sizeof(EarthPlace);
  return WriteMessage<schema::Reconstruction>(kPlaceBytes, [&](auto to) {
    to.setMergedInto(reconstruction.merged_into.value);
    to.setMergedFromThisScale(reconstruction.merged_from_this.scale);
    Fill(to.initMergedFromThis(), reconstruction.merged_from_this.rotation,
         reconstruction.merged_from_this.translation);
    to.setImageCount(reconstruction.image_count);
    to.setPointCount(reconstruction.point_count);
    to.setObservationCount(reconstruction.observation_count);
    to.setReprojectionErrorPxSum(reconstruction.reprojection_error_px_sum);
    to.setGeometryVersion(reconstruction.geometry_version);
    to.setPointsGeneration(reconstruction.points_generation);
    to.setImagesAtAdjustment(reconstruction.images_at_adjustment);
    to.setDissolved(reconstruction.is_dissolved);
    // A city that nothing places on the earth is stored as it was before there were places.
    const Georeference& georeference = reconstruction.georeference;
    if (georeference.images_at_look > 0 || georeference.version > 0)
      Fill(to.initGeoreference(), georeference);
  });
}

Status Decode(std::string_view value, ReconstructionId id, ReconstructionRecord* reconstruction) {
  return ReadMessage<schema::Reconstruction>(value, [&](schema::Reconstruction::Reader from) {
    reconstruction->id = id;
    reconstruction->merged_into = ReconstructionId(from.getMergedInto());
    Sim3& sim = reconstruction->merged_from_this;
    sim.scale = from.getMergedFromThisScale();
    Read(from.getMergedFromThis(), &sim.rotation, &sim.translation);
    reconstruction->image_count = from.getImageCount();
    reconstruction->point_count = from.getPointCount();
    reconstruction->observation_count = from.getObservationCount();
    reconstruction->reprojection_error_px_sum = from.getReprojectionErrorPxSum();
    reconstruction->geometry_version = from.getGeometryVersion();
    reconstruction->points_generation = from.getPointsGeneration();
    reconstruction->images_at_adjustment = from.getImagesAtAdjustment();
    reconstruction->is_dissolved = from.getDissolved();
    VEDUTA_RETURN_IF_ERROR(Read(from.getGeoreference(), &reconstruction->georeference));
    return Damaged(Check(*reconstruction));
  });
}

}  // namespace veduta
