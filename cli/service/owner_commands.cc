// SPDX-License-Identifier: Apache-2.0
#include "cli/service/owner_commands.h"

#include <limits>
#include <string>

#include "cli/service/pass_time.h"
#include "cli/service/request_parts.h"
#include "cli/wire/added_json.h"
#include "cli/wire/backup_json.h"
#include "cli/wire/dense_json.h"
#include "cli/wire/import_json.h"

namespace veduta {
namespace {

constexpr uint64_t kNumberMax = std::numeric_limits<uint32_t>::max();

HttpAnswer AnswerOf(const Status& status) {
  return status.ok() ? JsonAnswer(200, Json::object()) : ProblemOf(status);
}

// What a piece of work that goes on after failures has done, and the failure, or null.
HttpAnswer AnswerWith(Json done, const Status& status) {
  done["failure"] = status.ok() ? Json(nullptr) : Json::parse(ProblemOf(status).body);
  HttpAnswer answer = JsonAnswer(200, done);
  answer.is_of_disk = status.code() == StatusCode::kIoError;
  return answer;
}

Result<uint32_t> Small(const Json& object, const char* name) {
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t number, OptionalNumber(object, name, kNumberMax));
  return static_cast<uint32_t>(number);
}

Result<DensifyRequest> DensifyOf(const Json& wanted) {
  DensifyRequest request;
  VEDUTA_ASSIGN_OR_RETURN(const uint32_t reconstruction, Small(wanted, "reconstruction"));
  request.reconstruction = ReconstructionId(reconstruction);
  VEDUTA_ASSIGN_OR_RETURN(request.device, OptionalText(wanted, "device"));
  if (wanted.contains("size")) {
    if (!wanted["size"].is_number_unsigned() || wanted["size"].get<uint64_t>() > kNumberMax)
      return Status::InvalidArgument("'size' is no number of px");
    request.options.depth_side_px = wanted["size"].get<uint32_t>();
  }
  if (wanted.contains("sensors")) {
    VEDUTA_ASSIGN_OR_RETURN(request.options.sensor_count, Small(wanted, "sensors"));
  }
  if (wanted.contains("voxel")) {
    if (!wanted["voxel"].is_number()) return Status::InvalidArgument("'voxel' is no number");
    request.options.voxel_size = wanted["voxel"].get<double>();
  }
  return request;
}

// How long a pass may work; 0: as long as it takes.
Result<double> HoursOf(const Json& wanted) {
  if (!wanted.contains("hours")) return 0.0;
  const Json& hours = wanted["hours"];
  if (hours.is_number() && hours.get<double>() > 0 && hours.get<double>() <= kPassHoursMax)
    return hours.get<double>();
  return Status::InvalidArgument("'hours' is no number of hours");
}

}  // namespace

std::vector<CityRoute> OwnerRoutes() {
  std::vector<CityRoute> routes;
  for (const PathArguments& path : {PathArguments{"v1", "settle"},
                                    {"v1", "cameras", "calibrate"},
                                    {"v1", "densify"},
                                    {"v1", "vocabulary", "train"},
                                    {"v1", "vocabulary", "import"},
                                    {"v1", "models"},
                                    {"v1", "backups"},
                                    {"v1", "copies"}}) {
    CityRoute route = {"POST", path, {}, nullptr, false, false, Role::kAdmin, true};
    route.is_for_owner_alone = true;
    routes.push_back(route);
  }
  return routes;
}

OwnerCommands::OwnerCommands(Engine* engine, DenseKeeper* keeper, CameraKeeper* cameras,
                             std::string cache_folder)
    : engine_(engine), keeper_(keeper), cameras_(cameras), cache_folder_(std::move(cache_folder)) {}

HttpAnswer OwnerCommands::Answer(const HttpRequest& request) {
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<Json> wanted = JsonObjectOf(request);
  if (!wanted.ok()) return ProblemOf(wanted.status());
  return Do(request, *wanted);
}

HttpAnswer OwnerCommands::Do(const HttpRequest& request, const Json& wanted) {
  const std::string& what = request.path.back();
  if (what == "settle") return Settle();
  if (what == "calibrate") return CalibrateCameras();
  if (what == "densify") return Densify(wanted);
  if (what == "train") return Train(wanted);
  if (what == "backups") return Backup(wanted);
  if (what == "models") return ImportModel(wanted);
  const bool is_copy = what == "copies";
  const Result<std::string> path = TextMember(wanted, is_copy ? "folder" : "file");
  if (!path.ok()) return ProblemOf(path.status());
  const std::stop_token stop = stop_.get_token();
  return AnswerOf(is_copy ? engine_->Copy(*path, stop) : engine_->ImportVocabulary(*path, stop));
}

HttpAnswer OwnerCommands::Backup(const Json& wanted) {
  const Result<std::string> folder = TextMember(wanted, "folder");
  if (!folder.ok()) return ProblemOf(folder.status());
  const Result<uint32_t> keep = Small(wanted, "keep");
  if (!keep.ok()) return ProblemOf(keep.status());
  const auto report = engine_->Backup({*folder, *keep}, stop_.get_token());
  return report.ok() ? JsonAnswer(200, ToJson(*report)) : ProblemOf(report.status());
}

HttpAnswer OwnerCommands::CalibrateCameras() {
  const auto cameras = cameras_->CalibrateNow(stop_.get_token());
  if (!cameras.ok()) return ProblemOf(cameras.status());
  Json found = Json::array();
  for (const FirstCamera& camera : *cameras) found.push_back(ToJson(camera));
  return JsonAnswer(200, {{"cameras", std::move(found)}});
}

HttpAnswer OwnerCommands::Densify(const Json& wanted) {
  Result<DensifyRequest> request = DensifyOf(wanted);
  if (!request.ok()) return ProblemOf(request.status());
  const Result<double> hours = HoursOf(wanted);
  if (!hours.ok()) return ProblemOf(hours.status());
  request->cache_folder = cache_folder_;
  Json reports = Json::array();
  request->report = [&](const DensifyReport& report) {
    reports.push_back(ToJson(report));
    reports.back()["why_cpp"] = report.why_cpp;
  };
  DenseKeeper::OthersPass pass(keeper_, stop_.get_token());  // one runs at a time
  PassTime time(*hours, pass.token());
  request->progress = [&](std::string_view stage, size_t done, size_t total) {
    pass.Tell(stage, done, total);
    time.Look();
  };
  const auto done = engine_->Densify(*request, time.token());
  const bool is_over = time.HasEnded(done.status());  // which is no failure of the daemon's
  return AnswerWith({{"reports", std::move(reports)}, {"time_is_over", is_over}},
                    is_over ? Status::Ok() : done.status());
}

// Photos that cannot be judged and steps that fail keep nothing else from being imported.
HttpAnswer OwnerCommands::ImportModel(const Json& wanted) {
  ImportRequest request;
  for (const auto& [name, value] : {std::pair("model", &request.model),
                                    {"photos", &request.photos},
                                    {"contributor", &request.contributor}}) {
    Result<std::string> text = TextMember(wanted, name);
    if (!text.ok()) return ProblemOf(text.status());
    *value = *std::move(text);
  }
  Json failed = Json::array(), steps = Json::array();
  const auto imported = engine_->Import(
      request, stop_.get_token(),
      [&](const AddOutcome& outcome) {
        if (!outcome.failure.ok()) failed.push_back(ToJson(outcome));
      },
      [&](const FollowUp& step) {
        if (!step.status.ok()) steps.push_back(ToJson(step));
      });
  Json done = {{"failed", std::move(failed)}, {"failed_steps", std::move(steps)}};
  if (imported.ok()) done["import"] = ToJson(*imported);
  return AnswerWith(std::move(done), imported.status());
}

HttpAnswer OwnerCommands::Settle() {
  Json steps = Json::array();
  const Status settled = engine_->Settle(
      stop_.get_token(), [&](const FollowUp& step) { steps.push_back(ToJson(step)); });
  return AnswerWith({{"steps", std::move(steps)}}, settled);
}

HttpAnswer OwnerCommands::Train(const Json& wanted) {
  VocabularyRequest request;
  for (const auto& [name, value] : {std::pair("branch", &request.branch),
                                    {"levels", &request.levels},
                                    {"sample", &request.sample}}) {
    if (!wanted.contains(name)) continue;
    if (!wanted[name].is_number_unsigned() || wanted[name].get<uint64_t>() > kNumberMax)
      return ProblemOf(Status::InvalidArgument("'" + std::string(name) + "' is no whole number"));
    *value = wanted[name].get<uint32_t>();
  }
  return AnswerOf(engine_->TrainVocabulary(request, stop_.get_token()));
}

}  // namespace veduta
