// SPDX-License-Identifier: Apache-2.0
#include "cli/owner_beside.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "cli/daemon_json.h"
#include "cli/printable.h"
#include "cli/service/pass_time.h"
#include "cli/wire/added_json.h"

namespace veduta {
namespace {

// Between two questions what has become of a photo. Chosen by hand.
constexpr std::chrono::milliseconds kLook(50);

// The daemon's folder is another one.
std::string Absolute(const std::string& path) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(path, error);
  return error ? path : absolute.string();
}

// The failure of a piece of work that has told what it did.
Status FailureIn(const Json& answer) {
  const auto failure = answer.find("failure");
  return failure == answer.end() || failure->is_null() ? Status::Ok() : StatusOfProblem(*failure);
}

// The other way round than ToJson: null and what is missing are ids that are not valid.
template <typename Id>
Id IdOf(const Json& json) {
  return json.is_number_unsigned() ? Id(json.get<decltype(Id::value)>()) : Id();
}

template <typename Id>
std::vector<Id> IdsOf(const Json& json) {
  std::vector<Id> ids;
  for (const Json& id : json) ids.push_back(IdOf<Id>(id));
  return ids;
}

FollowUp FollowUpOf(const Json& json) {
  FollowUp step;
  for (const FollowUpKind kind :
       {FollowUpKind::kPropagation, FollowUpKind::kAdjustment, FollowUpKind::kJudgment,
        FollowUpKind::kVocabulary, FollowUpKind::kGeoreference}) {
    if (FollowUpWord(kind) == json.value("step", "")) step.kind = kind;
  }
  step.image = IdOf<ImageId>(json.at("image"));
  step.reconstruction = IdOf<ReconstructionId>(json.at("reconstruction"));
  step.other = IdOf<ReconstructionId>(json.at("other"));
  step.merged_into = IdOf<ReconstructionId>(json.at("merged_into"));
  step.placed = IdsOf<ImageId>(json.at("placed"));
  for (const Json& lost : json.at("unplaced"))
    step.unplaced.push_back({IdOf<ImageId>(lost.at("id")), lost.value("why", "")});
  step.split_off = IdsOf<ReconstructionId>(json.at("split_off"));
  step.ms = json.value("ms", 0.0);
  step.turn_ms = json.value("turn_ms", 0.0);
  if (json.at("error").is_string()) step.status = Status::IoError(json["error"].get<std::string>());
  return step;
}

StageCount StageOf(const Json& json) {
  StageCount count;
  count.computed = json.value("computed", uint64_t{0});
  count.kept = json.value("kept", uint64_t{0});
  count.removed = json.value("removed", uint64_t{0});
  count.ms = json.value("ms", 0.0);
  return count;
}

DensifyReport ReportOf(const Json& json) {
  DensifyReport report;
  report.reconstruction = IdOf<ReconstructionId>(json.at("reconstruction"));
  report.device = json.value("device", "");
  report.why_cpp = json.value("why_cpp", "");
  report.voxel_size = json.value("voxel_size", 0.0);
  report.depth_side_px = json.value("depth_side_px", 0u);
  report.sensor_count = json.value("sensor_count", 0u);
  for (const Json& photo : json.at("without_depth"))
    report.without_depth.push_back(
        {IdOf<ImageId>(photo.at("id")), photo.value("image", ""), photo.value("reason", "")});
  report.depths = StageOf(json.at("depth_maps"));
  report.checks = StageOf(json.at("checks"));
  report.volume = StageOf(json.at("volume"));
  report.volume.units = json.value("blocks_changed", uint64_t{0});
  report.solutions = StageOf(json.at("fusion"));
  report.meshes = StageOf(json.at("surface"));
  report.exposures = StageOf(json.at("exposures"));
  report.colors = StageOf(json.at("colors"));
  report.tiles = json.value("tiles", uint64_t{0});
  report.vertices = json.value("vertices", uint64_t{0});
  report.triangles = json.value("triangles", uint64_t{0});
  return report;
}

ImportAnswer ImportOf(const Json& json) {
  ImportAnswer answer;
  answer.reconstruction = IdOf<ReconstructionId>(json.at("reconstruction"));
  answer.points = json.value("points", uint64_t{0});
  answer.messages = json.value("messages", std::vector<std::string>());
  for (const Json& photo : json.at("photos")) {
    const Json& why_not = photo.at("why_not");
    answer.photos.push_back({photo.value("image", ""), IdOf<ImageId>(photo.at("id")),
                             photo.value("was_given_pose", false),
                             IdOf<ReconstructionId>(photo.at("reconstruction")),
                             why_not.is_string() ? why_not.get<std::string>() : ""});
  }
  return answer;
}

Result<Json> WaitForUpload(DaemonClient* daemon, uint64_t number) {
  for (;;) {
    VEDUTA_ASSIGN_OR_RETURN(
        const Json json,
        AskForJson(daemon, {"GET", "/v1/uploads/" + std::to_string(number), "", {}}));
    const std::string state = json.value("state", "");
    if (state == "failed") return Status::IoError(json.value("why_not", ""));
    if (json.value("awaits_camera", false)) return Status::NotFound(json.value("why_not", ""));
    if (state == "done" && json.contains("outcome")) return json["outcome"];
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace

Status CalibrateBeside(DaemonClient* daemon, const std::function<void(const std::string&)>& found) {
  VEDUTA_ASSIGN_OR_RETURN(const Json answer, Post(daemon, "/v1/cameras/calibrate", Json::object()));
  for (const Json& camera : answer.value("cameras", Json::array())) found(FirstCameraText(camera));
  return Status::Ok();
}

Status WaitForUploads(DaemonClient* daemon, const std::function<void(const Json&)>& placed) {
  VEDUTA_ASSIGN_OR_RETURN(const HttpAnswer answer, daemon->Ask({"GET", "/v1/uploads", "", {}}));
  const Json uploads = Json::parse(answer.body, nullptr, /*allow_exceptions=*/false);
  if (!uploads.is_array()) return Status::IoError(DetailOf(answer));
  Status failure;
  for (const Json& upload : uploads) {
    const Result<Json> outcome = WaitForUpload(daemon, upload.value("upload", uint64_t{0}));
    if (outcome.ok()) {
      placed(*outcome);
    } else {
      // One whose camera cannot be told yet is not at fault: it waits on.
      if (outcome.status().code() != StatusCode::kNotFound) failure = outcome.status();
      std::fprintf(stderr, "veduta: %s: %s\n", Printable(upload.value("image", "")).c_str(),
                   Printable(outcome.status().message()).c_str());
    }
  }
  return failure;
}

Status SettleBeside(DaemonClient* daemon, const std::function<void(const FollowUp&)>& followed) {
  VEDUTA_ASSIGN_OR_RETURN(const Json answer, Post(daemon, "/v1/settle", Json::object()));
  for (const Json& step : answer.value("steps", Json::array())) followed(FollowUpOf(step));
  return FailureIn(answer);
}

Status TrainBeside(DaemonClient* daemon, const VocabularyRequest& request) {
  const Json wanted = {
      {"branch", request.branch}, {"levels", request.levels}, {"sample", request.sample}};
  return Post(daemon, "/v1/vocabulary/train", wanted).status();
}

Status ImportBeside(DaemonClient* daemon, const std::string& file) {
  return Post(daemon, "/v1/vocabulary/import", {{"file", Absolute(file)}}).status();
}

Result<ImportAnswer> ImportModelBeside(DaemonClient* daemon, const ImportRequest& request,
                                       const std::function<void(const AddOutcome&)>& failed,
                                       const std::function<void(const FollowUp&)>& followed) {
  VEDUTA_ASSIGN_OR_RETURN(const Json answer, Post(daemon, "/v1/models",
                                                  {{"model", Absolute(request.model)},
                                                   {"photos", Absolute(request.photos)},
                                                   {"contributor", request.contributor}}));
  for (const Json& photo : answer.value("failed", Json::array())) {
    AddOutcome outcome;
    outcome.name = photo.value("image", "");
    outcome.failure = Status::IoError(photo.value("reason", ""));
    failed(outcome);
  }
  for (const Json& step : answer.value("failed_steps", Json::array())) followed(FollowUpOf(step));
  VEDUTA_RETURN_IF_ERROR(FailureIn(answer));
  return ImportOf(answer.at("import"));
}

Status CopyBeside(DaemonClient* daemon, const std::string& out) {
  return Post(daemon, "/v1/copies", {{"folder", Absolute(out)}}).status();
}

Result<BackupReport> BackupBeside(DaemonClient* daemon, const BackupRequest& request) {
  Json wanted = {{"folder", Absolute(request.folder)}};
  if (request.keep != 0) wanted["keep"] = request.keep;
  VEDUTA_ASSIGN_OR_RETURN(const Json json, Post(daemon, "/v1/backups", wanted));
  BackupReport report;
  report.backup = {json.value("backup", 0u), json.value("time", int64_t{0}),
                   json.value("database", ""), json.value("files", uint64_t{0}),
                   json.value("bytes", uint64_t{0})};
  report.copied_files = json.value("copied_files", uint64_t{0});
  report.copied_bytes = json.value("copied_bytes", uint64_t{0});
  report.deleted = json.value("deleted", 0u);
  return report;
}

Status DensifyBeside(DaemonClient* daemon, const DensifyRequest& request, double hours) {
  Json wanted = {{"device", request.device}};
  if (request.reconstruction.valid()) wanted["reconstruction"] = request.reconstruction.value;
  if (request.options.depth_side_px) wanted["size"] = *request.options.depth_side_px;
  if (request.options.sensor_count) wanted["sensors"] = *request.options.sensor_count;
  if (request.options.voxel_size) wanted["voxel"] = *request.options.voxel_size;
  if (hours > 0) wanted["hours"] = hours;
  VEDUTA_ASSIGN_OR_RETURN(const Json answer, Post(daemon, "/v1/densify", wanted));
  for (const Json& report : answer.value("reports", Json::array()))
    request.report(ReportOf(report));
  if (answer.value("time_is_over", false)) return PassTimeIsOver(hours);
  return FailureIn(answer);
}

void WarnOfThreads(uint32_t threads) {
  if (threads != 0)
    std::fprintf(stderr, "veduta: warning: --threads counts for nothing: the daemon does it\n");
}

}  // namespace veduta
