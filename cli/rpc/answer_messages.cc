// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/answer_messages.h"

#include "cli/wire/added_json.h"

namespace veduta {
namespace {

capnp::Text::Reader Reading(const std::string& text) {
  return {text.c_str(), text.size()};
}

rpc::Verdict VerdictOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPlaced:
      return rpc::Verdict::PLACED;
    case Verdict::kMerged:
      return rpc::Verdict::MERGED;
    case Verdict::kFounded:
      return rpc::Verdict::FOUNDED;
    case Verdict::kPostponed:
      return rpc::Verdict::POSTPONED;
    case Verdict::kRejected:
      break;
  }
  return rpc::Verdict::REJECTED;
}

void Write(const std::array<double, 3>& vector, rpc::Vector3::Builder message) {
  message.setX(vector[0]);
  message.setY(vector[1]);
  message.setZ(vector[2]);
}

void Write(const EstimatedCamera& camera, rpc::Camera::Builder message) {
  const CameraModel& model = camera.model;
  message.setWidthPx(model.width_px);
  message.setHeightPx(model.height_px);
  message.setFx(model.fx);
  message.setFy(model.fy);
  message.setCx(model.cx);
  message.setCy(model.cy);
  message.setK1(model.k1);
  message.setK2(model.k2);
  message.setU0(model.u0);
  message.setV0(model.v0);
  message.setFocalStddevShare(camera.focal_stddev_share);
}

}  // namespace

std::string TextOf(capnp::Text::Reader text) {
  return {text.begin(), text.size()};
}

void Write(const StatusAnswer& status, rpc::Status::Builder message) {
  message.setSnapshot(status.snapshot);
  message.setImages(status.images);
  message.setPlaced(status.placed);
  message.setPostponed(status.postponed);
  message.setRejected(status.rejected);
  message.setUnsure(status.unsure);
  message.setCameras(status.cameras);
  message.setUploads(status.uploads);
  message.setBacklog(status.backlog);
  message.setVocabularyGeneration(status.vocabulary_generation);
  message.setOpenHypotheses(status.open_hypotheses);
  message.setTotalBytes(status.total_bytes);
}

void Write(const AddOutcome& outcome, rpc::Outcome::Builder message) {
  message.setName(Reading(outcome.name));
  message.setId(outcome.id.value);
  message.setVerdict(outcome.duplicate ? rpc::Verdict::DUPLICATE : VerdictOf(outcome.verdict));
  message.setReason(Reading(OutcomeReason(outcome)));
  message.setReconstruction(outcome.reconstruction.value);
  message.setCamera(Reading(outcome.camera));
  message.setNeighbors(outcome.neighbor_count);
  message.setInliers(outcome.inlier_count);
  message.setPairsTried(outcome.pairs_tried);
  message.setReplaced(outcome.replaced);
}

void Write(const PlainPose& pose, ReconstructionId reconstruction, rpc::Pose::Builder message) {
  message.setReconstruction(reconstruction.value);
  auto rotation = message.initRotation();
  rotation.setW(pose.rotation_wxyz[0]);
  rotation.setX(pose.rotation_wxyz[1]);
  rotation.setY(pose.rotation_wxyz[2]);
  rotation.setZ(pose.rotation_wxyz[3]);
  Write(pose.translation, message.initTranslation());
  Write(pose.center, message.initCenter());
}

void Write(const EarthPose& pose, rpc::EarthPose::Builder message) {
  message.setLatitude(pose.position.latitude_deg);
  message.setLongitude(pose.position.longitude_deg);
  message.setHeightM(pose.position.height_m);
  message.setHeadingDeg(pose.heading_deg);
  message.setPitchDeg(pose.pitch_deg);
  message.setRollDeg(pose.roll_deg);
  message.setHorizontalStddevM(pose.horizontal_stddev_m);
  message.setVerticalStddevM(pose.vertical_stddev_m);
  message.setHeadingStddevDeg(pose.heading_stddev_deg);
}

void Write(const LocalizedPhoto& photo, rpc::Localized::Builder message) {
  message.setVerdict(VerdictOf(photo.verdict));
  message.setReason(Reading(LocalizedReason(photo)));
  message.setStored(photo.stored.value);
  if (photo.cam_from_world) Write(*photo.cam_from_world, photo.reconstruction, message.initPose());
  if (photo.on_earth) Write(*photo.on_earth, message.initOnEarth());
  if (photo.uncertainty) {
    message.setCenterStddev(photo.uncertainty->center_stddev);
    message.setRotationStddevDeg(photo.uncertainty->rotation_stddev_deg);
  }
  if (photo.camera) Write(*photo.camera, message.initCamera());
  message.setInliers(photo.inlier_count);
  message.setNeighbors(photo.neighbor_count);
  message.setPairsTried(photo.pairs_tried);
  auto support = message.initSupport(static_cast<unsigned>(photo.support.size()));
  for (unsigned i = 0; i < support.size(); ++i) {
    support[i].setId(photo.support[i].image.value);
    support[i].setName(Reading(photo.support[i].name));
    support[i].setPoints(photo.support[i].points);
  }
}

void Write(const std::vector<NeighborAnswer>& neighbors,
           capnp::List<rpc::Neighbor>::Builder message) {
  for (unsigned i = 0; i < message.size(); ++i) {
    message[i].setId(neighbors[i].image.value);
    message[i].setName(Reading(neighbors[i].name));
    message[i].setVerdict(VerdictOf(neighbors[i].verdict));
    message[i].setMatches(neighbors[i].matches);
    message[i].setScore(neighbors[i].score);
  }
}

void Write(const std::vector<ReconstructionAnswer>& reconstructions,
           capnp::List<rpc::Reconstruction>::Builder message) {
  for (unsigned i = 0; i < message.size(); ++i) {
    message[i].setId(reconstructions[i].id.value);
    message[i].setImages(reconstructions[i].images);
    message[i].setPoints(reconstructions[i].points);
    message[i].setObservations(reconstructions[i].observations);
    message[i].setReprojectionErrorPxMean(reconstructions[i].reprojection_error_px_mean);
    message[i].setGeometryVersion(reconstructions[i].geometry_version);
  }
}

void Write(const std::vector<JournalAnswer>& entries,
           capnp::List<rpc::JournalEntry>::Builder message) {
  for (unsigned i = 0; i < message.size(); ++i) {
    message[i].setNumber(entries[i].sequence);
    message[i].setTime(entries[i].time_unix_s);
    message[i].setActor(Reading(entries[i].actor));
    message[i].setAction(Reading(entries[i].action));
    message[i].setImage(entries[i].image.value);
    message[i].setReconstruction(entries[i].reconstruction.value);
    message[i].setDetail(Reading(entries[i].detail));
  }
}

}  // namespace veduta
