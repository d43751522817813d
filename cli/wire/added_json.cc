// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/added_json.h"

#include "cli/wire/answers_json.h"
#include "cli/wire/earth_json.h"

namespace veduta {

std::string OutcomeWord(const AddOutcome& outcome) {
  if (!outcome.failure.ok()) return "failed";
  return outcome.duplicate ? "duplicate" : VerdictWord(outcome.verdict);
}

std::string OutcomeReason(const AddOutcome& outcome) {
  if (!outcome.failure.ok()) return outcome.failure.message();
  return outcome.duplicate ? outcome.detail : ReasonSentence(outcome.reason, outcome.detail);
}

std::string LocalizedWord(const LocalizedPhoto& photo) {
  if (!photo.failure.ok()) return "failed";
  if (photo.verdict == Verdict::kRejected) return "rejected";
  return photo.cam_from_world ? "localized" : "refused";
}

std::string LocalizedReason(const LocalizedPhoto& photo) {
  return photo.failure.ok() ? ReasonSentence(photo.reason, photo.detail) : photo.failure.message();
}

std::string FollowUpWord(FollowUpKind kind) {
  switch (kind) {
    case FollowUpKind::kPropagation:
      return "propagation";
    case FollowUpKind::kAdjustment:
      return "adjustment";
    case FollowUpKind::kJudgment:
      return "judgment";
    case FollowUpKind::kGeoreference:
      return "georeference";
    case FollowUpKind::kVocabulary:
      return "vocabulary";
  }
  return "unknown";
}

Json ToJson(const DamagedImage& damaged) {
  return {{"id", ToJson(damaged.image)}, {"what", damaged.what}};
}

Json ToJson(const AddOutcome& outcome) {
  return {{"image", outcome.name},
          {"id", ToJson(outcome.id)},
          {"verdict", OutcomeWord(outcome)},
          {"reason", OutcomeReason(outcome)},
          {"replaced", outcome.replaced},
          {"reconstruction", ToJson(outcome.reconstruction)},
          {"camera", outcome.camera.empty() ? Json() : Json(outcome.camera)},
          {"neighbors", outcome.neighbor_count},
          {"inliers", outcome.inlier_count},
          {"pairs_tried", outcome.pairs_tried},
          {"propagated", ToJson(outcome.propagated)},
          {"unplaced", ToJson(outcome.unplaced)},
          {"split_off", ToJson(outcome.split_off)},
          {"damaged", ToJson(outcome.damaged)},
          {"ms", ToJson(outcome.times)}};
}

Json ToJson(const EstimatedCamera& camera) {
  const CameraModel& model = camera.model;
  return {{"size", CameraSizeText(model)},
          {"params", CameraParamsText(model)},
          {"focal", model.fx},
          {"focal_stddev", camera.focal_stddev_share * model.fx},
          {"k1", model.k1},
          {"k1_stddev", camera.k1_stddev},
          {"k2", model.k2},
          {"k2_stddev", camera.k2_stddev}};
}

Json ToJson(const LocalizedPhoto& photo) {
  Json support = Json::array();
  for (const SupportAnswer& image : photo.support)
    support.push_back({{"id", image.image.value}, {"image", image.name}, {"points", image.points}});
  Json json = {{"image", photo.name},
               {"verdict", LocalizedWord(photo)},
               {"reason", LocalizedReason(photo)},
               {"stored", ToJson(photo.stored)},
               {"reconstruction", ToJson(photo.reconstruction)},
               {"pose", nullptr},
               {"on_earth", ToJson(photo.on_earth)},
               {"uncertainty", ToJson(photo.uncertainty)},
               {"camera", nullptr},
               {"neighbors", photo.neighbor_count},
               {"inliers", photo.inlier_count},
               {"pairs_tried", photo.pairs_tried},
               {"support", std::move(support)},
               {"damaged", ToJson(photo.damaged)},
               {"ms", ToJson(photo.times)}};
  if (const auto& pose = photo.cam_from_world) {
    json["pose"] = {{"rotation_wxyz", pose->rotation_wxyz},
                    {"translation", pose->translation},
                    {"center", pose->center}};
  }
  if (photo.camera) json["camera"] = ToJson(*photo.camera);
  return json;
}

Json ToJson(const LostPose& lost) {
  return {{"id", lost.image.value}, {"why", lost.detail}};
}

Json ToJson(const StepTimes& times) {
  return {{"decode", times.decode_ms},
          {"undistort", times.undistort_ms},
          {"features", times.features_ms},
          {"retrieve", times.retrieve_ms},
          {"match", times.match_ms},
          {"verify", times.verify_ms},
          {"map", times.map_ms},
          {"adjust", times.adjust_ms},
          {"commit", times.commit_ms},
          {"follow", times.follow_ms},
          {"longest_step", times.longest_step_ms},
          {"total", times.total_ms}};
}

Json ToJson(const FollowUp& step) {
  return {{"step", FollowUpWord(step.kind)},
          {"image", ToJson(step.image)},
          {"reconstruction", ToJson(step.reconstruction)},
          {"other", ToJson(step.other)},
          {"merged_into", ToJson(step.merged_into)},
          {"placed", ToJson(step.placed)},
          {"unplaced", ToJson(step.unplaced)},
          {"split_off", ToJson(step.split_off)},
          {"ms", step.ms},
          {"turn_ms", step.turn_ms},
          {"error", step.status.ok() ? Json(nullptr) : Json(step.status.message())}};
}

Json ToJson(const FirstCamera& camera) {
  const bool is_known = !camera.name.empty();
  return {{"camera", is_known ? Json(camera.name) : Json()},
          {"photos", camera.photos},
          {"params", is_known ? Json(CameraParamsText(camera.model)) : Json()},
          {"focal_stddev_share", is_known ? Json(camera.focal_stddev_share) : Json()},
          {"why_not", is_known ? Json() : Json(camera.why_not)}};
}

std::string FirstCameraText(const Json& camera) {
  const std::string of_photos =
      "the camera of " + std::to_string(camera.value("photos", 0u)) + " photos ";
  if (!camera.contains("camera") || !camera["camera"].is_string())
    return of_photos + "could not be calibrated: " + camera.value("why_not", "");
  char share[32];
  std::snprintf(share, sizeof(share), "%.2g", 100 * camera.value("focal_stddev_share", 0.0));
  return of_photos + "is '" + camera.value("camera", "") + "' now: " + camera.value("params", "") +
         ", focal length to " + share + " %";
}

}  // namespace veduta
