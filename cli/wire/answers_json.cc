// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/answers_json.h"

#include "cli/wire/earth_json.h"

namespace veduta {
namespace {

// Where a reconstruction went that was merged away; null for a living one.
Json MergedIntoJson(const ReconstructionAnswer& r) {
  if (!r.merged_into.valid()) return nullptr;
  return {{"reconstruction", r.merged_into.value},
          {"scale", r.merged_scale},
          {"rotation_wxyz", r.merged_pose.rotation_wxyz},
          {"translation", r.merged_pose.translation}};
}

Json ToJson(const StorageAnswer& storage) {
  return {{"log_bytes", storage.log_bytes},
          {"flush_bytes", storage.flush_bytes},
          {"compaction_bytes", storage.compaction_bytes},
          {"blob_bytes", storage.blob_bytes},
          {"blob_copied_bytes", storage.blob_copied_bytes},
          {"cache_hits", storage.cache_hits},
          {"cache_misses", storage.cache_misses}};
}

// The warnings of a calibration, or the notes: those on single photos stand last.
Json TextsOf(const CalibrationAnswer& calibration, bool warnings) {
  Json texts = Json::array();
  for (const bool is_of_photo : {false, true}) {
    for (const CalibrationMessage& message : calibration.messages) {
      if (message.is_warning == warnings && message.is_of_photo == is_of_photo)
        texts.push_back(message.text);
    }
  }
  return texts;
}

}  // namespace

Json ToJson(const UploadAnswer& upload) {
  return {{"upload", upload.number},
          {"image", upload.name},
          {"contributor", upload.contributor},
          {"camera", upload.camera},
          {"photo", upload.photo},
          {"bytes", upload.size_bytes},
          {"time", upload.time_unix_s},
          {"contribution", upload.contribution == 0 ? Json(nullptr) : Json(upload.contribution)}};
}

Json ToJson(const StatusAnswer& status) {
  return {{"images", status.images},
          {"placed", status.placed},
          {"unsure", status.unsure},
          {"postponed", status.postponed},
          {"rejected", status.rejected},
          {"cameras", status.cameras},
          {"uploads", status.uploads},
          {"backlog", status.backlog},
          {"vocabulary_generation", status.vocabulary_generation},
          {"bytes", status.total_bytes},
          {"storage", ToJson(status.storage)},
          {"reconstructions", ToJson(status.reconstructions)},
          {"open_hypotheses", status.open_hypotheses},
          {"doubtful_seams", ToJson(status.doubtful_seams)}};
}

Json ToJson(const ReconstructionAnswer& r) {
  return {{"id", r.id.value},
          {"images", r.images},
          {"points", r.points},
          {"observations", r.observations},
          {"reprojection_error_px_mean", r.reprojection_error_px_mean},
          {"geometry_version", r.geometry_version},
          {"depth_maps", r.depth_maps},
          {"tiles", r.tiles},
          {"triangles", r.triangles},
          {"merged_into", MergedIntoJson(r)},
          {"dissolved", r.dissolved}};
}

Json ToJson(const ImageAnswer& image) {
  return {{"image", image.name},
          {"id", image.id.value},
          {"verdict", VerdictWord(image.verdict)},
          {"reason", ReasonSentence(image.reason, image.detail)},
          {"reconstruction", ToJson(image.reconstruction)},
          {"may_stand_in", ToJson(image.may_stand_in)},
          {"camera", image.camera.value},
          {"width", image.width_px},
          {"height", image.height_px},
          {"orientation", image.orientation},
          {"bytes", image.size_bytes},
          {"sha256", image.sha256},
          {"contributor", image.contributor},
          {"time", image.time_unix_s},
          {"features", image.features},
          {"observations", image.observations},
          {"neighbors", ToJson(image.neighbors)},
          {"depth_map", ToJson(image.depth_map)},
          {"uncertainty", ToJson(image.uncertainty)},
          {"hypotheses", ToJson(image.hypotheses)},
          {"gps", ToJson(image.gps)},
          {"taken", ToJson(image.taken)},
          {"contribution", image.contribution == 0 ? Json() : Json(image.contribution)},
          {"on_earth", ToJson(image.on_earth)},
          {"hidden", image.is_hidden}};
}

Json ToJson(const ListedImage& image) {
  Json json = {{"id", image.id.value},
               {"image", image.name},
               {"contributor", image.contributor},
               {"verdict", VerdictWord(image.verdict)},
               {"reconstruction", ToJson(image.reconstruction)},
               {"unsure", image.is_unsure},
               {"hidden", image.is_hidden},
               {"orientation", image.orientation},
               {"rotation_wxyz", nullptr},
               {"center", nullptr}};
  if (image.cam_from_world) {
    json["rotation_wxyz"] = image.cam_from_world->rotation_wxyz;
    json["center"] = image.cam_from_world->center;
  }
  return json;
}

Json ToJson(const HypothesisAnswer& h) {
  return {{"kind", "merge"},
          {"a", h.a.value},
          {"b", h.b.value},
          {"reason", h.reason},
          {"common_points", h.common_points},
          {"pairs_for", h.pairs_for},
          {"pairs_against", h.pairs_against},
          {"matches_for", h.matches_for},
          {"matches_against", h.matches_against},
          {"parts_judged", h.parts_judged},
          {"parts_missing", h.parts_missing},
          {"scale", h.is_open ? Json() : Json(h.scale)},
          {"rotation_wxyz", h.is_open ? Json() : Json(h.pose.rotation_wxyz)},
          {"translation", h.is_open ? Json() : Json(h.pose.translation)},
          {"image", ToJson(h.image)},
          {"unsure", ToJson(h.unsure)},
          {"judgments", h.judgments},
          {"due", h.due},
          {"time", h.time_unix_s}};
}

Json ReconstructionJson(const ReconstructionAnswer& reconstruction,
                        const std::vector<HypothesisAnswer>& hypotheses) {
  Json json = ToJson(reconstruction);
  json["hypotheses"] = ToJson(hypotheses);
  return json;
}

Json ToJson(const PoseUncertainty& uncertainty) {
  return {{"center_stddev", uncertainty.center_stddev},
          {"rotation_stddev_deg", uncertainty.rotation_stddev_deg},
          {"covariance", uncertainty.covariance},
          {"error_px", uncertainty.error_px},
          {"points", uncertainty.points},
          {"images_held", uncertainty.images_held}};
}

Json ToJson(const DepthMapAnswer& depth_map) {
  return {{"width", depth_map.width_px},
          {"height", depth_map.height_px},
          {"known_share", depth_map.known_share},
          {"depth_near", depth_map.depth_near},
          {"depth_far", depth_map.depth_far},
          {"sensors", depth_map.sensors},
          {"geometry_version", depth_map.geometry_version}};
}

Json ToJson(const NeighborAnswer& neighbor) {
  return {{"id", neighbor.image.value},
          {"image", neighbor.name},
          {"matches", neighbor.matches},
          {"verdict", VerdictWord(neighbor.verdict)}};
}

Json ToJson(const RepairAnswer& repair) {
  Json findings = Json::array();
  for (const RepairFinding& finding : repair.findings)
    findings.push_back({{"damage", finding.damage}, {"remedy", finding.remedy}});
  return {{"sound", repair.is_sound},
          {"repaired", repair.is_repaired},
          {"rebuilt", repair.is_rebuilt},
          {"findings", std::move(findings)},
          {"lost", repair.lost},
          {"retried", repair.retried},
          {"written_out", repair.written_out},
          {"kept_path", repair.kept_path},
          {"report_path", repair.report_path},
          {"photos_path", repair.photos_path}};
}

Json ToJson(const CalibratedPhoto& photo) {
  const bool is_used = photo.why_left_out.empty();
  return {{"name", photo.name},
          {"points", photo.points},
          {"points_left_out", photo.points_left_out},
          {"error_px_rms", is_used ? Json(photo.error_px_rms) : Json(nullptr)},
          {"left_out", photo.why_left_out}};
}

Json CandidatesJson(const std::vector<NeighborAnswer>& candidates) {
  Json list = Json::array();
  for (const NeighborAnswer& candidate : candidates) {
    list.push_back({{"id", candidate.image.value},
                    {"image", candidate.name},
                    {"score", candidate.score},
                    {"verdict", VerdictWord(candidate.verdict)}});
  }
  return list;
}

Json ToJson(const CameraAnswer& camera) {
  return {{"id", camera.id.value},
          {"name", camera.name},
          {"size", CameraSizeText(camera.model)},
          {"params", CameraParamsText(camera.model)},
          {"source", camera.source},
          {"version", camera.version},
          {"focal_stddev_share",
           camera.focal_stddev_share ? Json(*camera.focal_stddev_share) : Json(nullptr)}};
}

Json ToJson(const VocabularyAnswer& vocabulary) {
  return {{"generation", vocabulary.generation},
          {"branch", vocabulary.branch},
          {"depth", vocabulary.depth},
          {"words", vocabulary.words},
          {"training_descriptors", vocabulary.training_descriptors},
          {"images_at_training", vocabulary.images_at_training},
          {"imported", vocabulary.imported}};
}

Json ToJson(const JournalAnswer& entry) {
  return {{"sequence", entry.sequence},   {"time", entry.time_unix_s},
          {"actor", entry.actor},         {"action", entry.action},
          {"image", ToJson(entry.image)}, {"reconstruction", ToJson(entry.reconstruction)},
          {"detail", entry.detail}};
}

Json PoseJson(const ImageAnswer& image) {
  const PlainPose pose = image.cam_from_world.value_or(PlainPose{});
  return {{"image", image.name},
          {"reconstruction", ToJson(image.reconstruction)},
          {"rotation_wxyz", pose.rotation_wxyz},
          {"translation", pose.translation},
          {"center", pose.center},
          {"on_earth", ToJson(image.on_earth)},
          {"uncertainty", ToJson(image.uncertainty)}};
}

Json ViolationsJson(const std::vector<std::string>& violations) {
  return {{"sound", violations.empty()}, {"violations", violations}};
}

Json DigestJson(const std::string& digest) {
  return Json::object({{"digest", digest}});
}

Json CameraFileJson(const CalibrationAnswer& calibration) {
  Json intrinsics, sigmas;
  for (size_t i = 0; i < calibration.intrinsics.size(); ++i) {
    intrinsics[calibration.intrinsic_names[i]] = calibration.intrinsics[i];
    sigmas[calibration.intrinsic_names[i]] = calibration.sigmas[i];
  }
  return {{"format", kCameraFileFormat},
          {"version", kCameraFileVersion},
          {"width", calibration.model.width_px},
          {"height", calibration.model.height_px},
          {"intrinsics", std::move(intrinsics)},
          {"standard_deviations", std::move(sigmas)},
          {"calibration",
           {{"from", calibration.from},
            {"status", calibration.is_good ? "good" : "uncertain"},
            {"photos_used", calibration.photos_used},
            {"error_px_mean", calibration.error_px_mean},
            {"error_px_rms", calibration.error_px_rms},
            {"distortion_sigma_px", calibration.distortion_sigma_px},
            {"square_pixels", calibration.has_square_pixels},
            {"warnings", TextsOf(calibration, true)},
            {"notes", TextsOf(calibration, false)},
            {"photos", ToJson(calibration.calibrated_photos)}}}};
}

}  // namespace veduta
