// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/photo_admission.h"

#include <ctime>

namespace veduta {
namespace {

ImageRecord NewRecord(const PreparedPhoto& photo, CameraId camera, const std::string& contributor) {
  ImageRecord record;
  record.name = photo.name;
  record.photo = photo.hash;
  record.camera = camera;
  record.width_px = photo.width_px;
  record.height_px = photo.height_px;
  record.orientation = photo.orientation;
  record.size_bytes = photo.size_bytes;
  record.feature_count = static_cast<uint32_t>(photo.features.size());
  record.contributor = contributor;
  record.time_unix_s = std::time(nullptr);
  record.gps = photo.gps;
  record.taken = photo.taken;
  record.media_type = photo.media_type;
  record.contribution = photo.contribution;
  return record;
}

}  // namespace

Result<Admission> Admit(const Snapshot& snapshot, const PreparedPhoto& photo, CameraId camera,
                        const std::string& contributor) {
  Admission admission;
  VEDUTA_ASSIGN_OR_RETURN(std::optional<ImageId> same, snapshot.FindImageByPhoto(photo.hash));
  if (!same && photo.original) {
    VEDUTA_ASSIGN_OR_RETURN(same, snapshot.FindImageByPhoto(HashContent(*photo.original)));
  }
  if (same) {
    VEDUTA_ASSIGN_OR_RETURN(admission.stored, snapshot.GetImage(*same));
    admission.outcome = AdmissionOutcome::kDuplicate;
    return admission;
  }
  admission.record = NewRecord(photo, camera, contributor);
  // A photo that was known was not prepared; what was written ahead of another copy is gone with
  // it.
  VEDUTA_ASSIGN_OR_RETURN(const bool is_there, snapshot.IsWrittenAhead(photo.hash));
  admission.is_prepared = photo.reason == Reason::kNone && !photo.known && is_there;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> namesake,
                          snapshot.FindImageByName(photo.name, contributor));
  if (namesake) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord stored, snapshot.GetImage(*namesake));
    if (stored.verdict != Verdict::kRejected) {
      admission.outcome = AdmissionOutcome::kNameTaken;
      return admission;
    }
    admission.record.id = *namesake;
  }
  if (photo.reason != Reason::kNone) {
    admission.outcome = AdmissionOutcome::kRejected;
    return admission;
  }
  if (!admission.is_prepared) admission.outcome = AdmissionOutcome::kOutdated;
  return admission;
}

}  // namespace veduta
