// SPDX-License-Identifier: Apache-2.0
#include "cli/beside_daemon.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <set>
#include <thread>

#include "cli/command.h"
#include "cli/daemon_json.h"
#include "cli/owner_beside.h"
#include "cli/progress.h"
#include "cli/wire/added_json.h"
#include "storage/base/whole_file.h"

namespace veduta {
namespace {

// Photos that are sent before the first of them has had its turn: the daemon prepares them side by
// side. Chosen by hand.
constexpr size_t kAheadMax = 16;
// Between two questions what has become of a photo. Chosen by hand.
constexpr std::chrono::milliseconds kLook(20);
// Of the photos whose cameras were looked for once more the share that must have got one for the
// others to be tried again.
constexpr double kTriedAgainShareMin = 0.05;
// The largest photo that is read; the daemon says itself what it takes.
constexpr size_t kPhotoBytesMax = size_t{1} << 30;

class Adding final {
 public:
  Adding(DaemonClient* daemon, size_t photo_count, bool json)
      : daemon_(*daemon), json_(json), progress_(photo_count) {}

  // Sends the photo, however often the daemon says that there is no room yet.
  Status Send(const PhotoSubmission& photo, const std::stop_token& stop) {
    const Result<std::string> bytes = ReadWholeFile(photo.photo.path, kPhotoBytesMax);
    if (!bytes.ok()) return Fails(photo.photo.name, bytes.status().message());
    DaemonClient::Question question;
    question.method = "POST";
    question.path = "/v1/photos?name=" + EncodeForQuery(photo.photo.name) +
                    "&contributor=" + EncodeForQuery(photo.contributor);
    if (!photo.camera.empty()) question.path += "&camera=" + EncodeForQuery(photo.camera);
    question.content_type = "application/octet-stream";
    question.body = {reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size()};
    question.prefers_async = true;
    for (;;) {
      VEDUTA_ASSIGN_OR_RETURN(const HttpAnswer answer, daemon_.Ask(question));
      if (answer.code == 202) {
        sent_.push_back({photo.photo.name, HeaderOf(answer, "Location")});
        return Status::Ok();
      }
      const bool has_no_room = answer.code == 429 || answer.code == 503;
      if (!has_no_room) return Fails(photo.photo.name, DetailOf(answer));
      if (stop.stop_requested()) return Status::Cancelled("stopped before all photos were sent");
      if (!sent_.empty()) {
        VEDUTA_RETURN_IF_ERROR(TellFirst(stop));
      } else {
        std::this_thread::sleep_for(std::chrono::seconds(1));
      }
    }
  }

  size_t waiting() const { return sent_.size(); }

  // Waits for the first that was sent, and says what has become of it. kCancelled where a stop is
  // requested meanwhile.
  Status TellFirst(const std::stop_token& stop) {
    const std::string name = sent_.front().name, path = sent_.front().path;
    sent_.pop_front();
    for (;;) {
      VEDUTA_ASSIGN_OR_RETURN(const HttpAnswer answer, daemon_.Ask({"GET", path, "", {}}));
      const Json json = Json::parse(answer.body, nullptr, /*allow_exceptions=*/false);
      if (answer.code != 200 || !json.is_object()) return Fails(name, DetailOf(answer));
      if (json.value("awaits_camera", false)) {
        put_off_.push_back({name, path, json.value("why_not", "")});
        return Status::Ok();
      }
      const Json outcome = json.value("outcome", Json());
      if (json.value("state", "") == "failed") return Fails(name, json.value("why_not", ""));
      if (outcome.is_object()) return Tell(name, outcome);
      if (stop.stop_requested())
        return Status::Cancelled("stopped: the daemon places those that were sent");
      std::this_thread::sleep_for(kLook);
    }
  }

  // Has the cameras looked for of those that still have none, once all others had their turn, and
  // says what has become of them, until next to none gets one. What has none then waits on.
  Status TryPutOff(const std::stop_token& stop) {
    for (double share = 0; !put_off_.empty() && !stop.stop_requested();
         share = kTriedAgainShareMin) {
      VEDUTA_RETURN_IF_ERROR(CalibrateBeside(&daemon_, [&](const std::string& camera) {
        progress_.Say("veduta: " + Printable(camera));
      }));
      const auto before = static_cast<double>(put_off_.size());
      for (Sent& photo : std::exchange(put_off_, {})) sent_.push_back(std::move(photo));
      while (!sent_.empty()) VEDUTA_RETURN_IF_ERROR(TellFirst(stop));
      if (before - static_cast<double>(put_off_.size()) <= share * before) break;
    }
    for (const Sent& photo : std::exchange(put_off_, {}))
      VEDUTA_RETURN_IF_ERROR(
          Fails(photo.name, photo.why_not + ". It waits, and is tried again as the city grows"));
    return Status::Ok();
  }

  // "9 placed, 1 postponed"; empty where there is nothing to tell.
  std::string Summary() const { return TextOfCounts(counts_); }
  int exit_code() const { return exit_code_; }

 private:
  struct Sent {
    std::string name, path;
    std::string why_not = {};  // of one whose camera cannot be told yet
  };

  Status Tell(const std::string& name, const Json& outcome) {
    const std::string word = outcome.value("verdict", "");
    if (word == "rejected") exit_code_ = kNotDone;
    ++counts_[word];
    if (json_) {
      PrintJson(outcome);
    } else {
      PrintLine("%-10s %s: %s", Printable(word).c_str(), Printable(name).c_str(),
                Printable(outcome.value("reason", "")).c_str());
      const Json camera = outcome.value("camera", Json());
      if (camera.is_string())
        PrintLine("  with camera %s", Printable(camera.get<std::string>()).c_str());
    }
    progress_.Advance(word);
    return Status::Ok();
  }

  Status Fails(const std::string& name, const std::string& why) {
    exit_code_ = kNotDone;
    AddOutcome failed;
    failed.name = name;
    failed.failure = Status::IoError(why);
    const std::string word = OutcomeWord(failed);
    ++counts_[word];
    if (json_) {
      PrintJson(ToJson(failed));
    } else {
      PrintLine("%-10s %s: %s", word.c_str(), Printable(name).c_str(), Printable(why).c_str());
    }
    progress_.Advance(word);
    return Status::Ok();
  }

  DaemonClient& daemon_;
  const bool json_;
  Progress progress_;
  std::deque<Sent> sent_;
  std::vector<Sent> put_off_;
  std::map<std::string, size_t> counts_;  // by verdict
  int exit_code_ = kDone;
};

// A camera that is not there is said before anything is sent, as without a daemon.
Status CheckCameras(DaemonClient* daemon, std::span<const PhotoSubmission> photos) {
  std::set<std::string> names;
  for (const PhotoSubmission& photo : photos)
    if (!photo.camera.empty()) names.insert(photo.camera);
  for (const std::string& name : names)
    VEDUTA_RETURN_IF_ERROR(
        AskForJson(daemon, {"GET", "/v1/cameras/" + EncodeForQuery(name), "", {}}).status());
  return Status::Ok();
}

}  // namespace

int AddBeside(DaemonClient* daemon, std::span<const PhotoSubmission> photos, bool json,
              const std::stop_token& stop) {
  if (const Status known = CheckCameras(daemon, photos); !known.ok()) return Fail(known);
  std::string summary;
  int exit_code = kDone;
  Status added;
  {
    Adding adding(daemon, photos.size(), json);
    const auto add_all = [&]() -> Status {
      for (const PhotoSubmission& photo : photos) {
        if (stop.stop_requested()) return Status::Cancelled("stopped before all photos were sent");
        if (adding.waiting() >= kAheadMax) VEDUTA_RETURN_IF_ERROR(adding.TellFirst(stop));
        VEDUTA_RETURN_IF_ERROR(adding.Send(photo, stop));
      }
      while (adding.waiting() > 0) VEDUTA_RETURN_IF_ERROR(adding.TellFirst(stop));
      return adding.TryPutOff(stop);
    };
    added = add_all();
    summary = adding.Summary();
    exit_code = adding.exit_code();
  }  // which erases the bar
  if (!summary.empty()) std::fprintf(stderr, "%s\n", summary.c_str());
  return added.ok() ? exit_code : Fail(added);
}

int AddCameraBeside(DaemonClient* daemon, const std::string& name, const CameraModel& model) {
  const Json camera = {
      {"name", name}, {"size", CameraSizeText(model)}, {"params", CameraParamsText(model)}};
  const Result<Json> added = Post(daemon, "/v1/cameras", camera);
  return added.ok() ? kDone : Fail(added.status());
}

int RemoveBeside(DaemonClient* daemon, const RemoveRequest& request, bool json) {
  Json wanted = {{"actor", request.actor}, {"why", request.why}};
  if (!request.photos.empty()) wanted["photos"] = request.photos;
  if (!request.contributor.empty()) wanted["contributor"] = request.contributor;
  if (request.contribution != 0) wanted["contribution"] = request.contribution;
  const Result<Json> answer = Post(daemon, "/v1/removals", wanted);
  if (!answer.ok()) return Fail(answer.status());
  const bool is_purged = answer->value("purged", false);
  if (json) {
    PrintJson(*answer);
  } else {
    const Json removed = answer->value("removed", Json::array());
    const auto uploads = answer->value("uploads", uint64_t{0});
    for (const Json& photo : removed)
      PrintLine("removed    %s (#%u)", Printable(photo.value("image", "")).c_str(),
                photo.value("id", 0u));
    if (uploads > 0) PrintLine("removed    %lu photos that waited for their turn", uploads);
    if (is_purged) PrintLine("no file of the database has bytes of removed photos any more");
    if (std::ranges::any_of(removed, [](const Json& p) { return p.value("was_dense", false); }))
      PrintLine("parts of the surface went with them: `veduta densify` makes them anew");
    for (const Json& copy : answer->value("copies", Json::array()))
      PrintLine("out of reach: the copy in %s", Printable(copy.get<std::string>()).c_str());
    if (!removed.empty() || uploads > 0)
      PrintLine("out of reach: copies of the folder that others have made");
  }
  return is_purged ? kDone : Fail(Status::Busy(answer->value("why_not", "")));
}

int StateBeside(DaemonClient* daemon, const ForbidRequest& request, bool allows) {
  const char* const kind = request.kind == ForbidKind::kPair    ? "pair"
                           : request.kind == ForbidKind::kMerge ? "merge"
                                                                : "pose";
  const Json statement = {{"kind", kind},
                          {"a", request.a},
                          {"b", request.b},
                          {"actor", request.actor},
                          {"reason", request.reason}};
  const Result<Json> stated = Post(daemon, allows ? "/v1/allowed" : "/v1/forbidden", statement);
  return stated.ok() ? kDone : Fail(stated.status());
}

Result<NewToken> MakeTokenBeside(DaemonClient* daemon, const TokenRequest& request) {
  Json wanted = {
      {"name", request.name}, {"role", RoleWord(request.role)}, {"actor", request.actor}};
  if (request.expires_unix_s != 0) wanted["expires"] = request.expires_unix_s;
  if (request.quota.photos_per_day != 0) wanted["photos_per_day"] = request.quota.photos_per_day;
  if (request.quota.bytes_per_day != 0) wanted["bytes_per_day"] = request.quota.bytes_per_day;
  if (request.quota.requests_per_s != 0)
    wanted["requests_per_second"] = request.quota.requests_per_s;
  if (request.is_link) wanted["link"] = true;
  if (request.contribution != 0) wanted["contribution"] = request.contribution;
  if (request.reconstruction != 0) wanted["reconstruction"] = request.reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(const Json made, Post(daemon, "/v1/tokens", wanted));
  return NewToken{made.value("number", 0u), made.value("token", "")};
}

int RevokeTokenBeside(DaemonClient* daemon, uint32_t number, const std::string& actor) {
  const Result<Json> revoked =
      Post(daemon, "/v1/tokens/" + std::to_string(number) + "/revoke", Json{{"actor", actor}});
  return revoked.ok() ? kDone : Fail(revoked.status());
}

Result<GeoreferenceAnswer> GeoreferenceBeside(DaemonClient* daemon,
                                              const GeoreferenceRequest& request) {
  std::string text;
  if (!request.ground_points_path.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(text, ReadWholeFile(request.ground_points_path, kPhotoBytesMax));
    if (text.empty()) return Status::InvalidArgument(request.ground_points_path + " is empty");
  }
  DaemonClient::Question question{"POST", "/v1/georeference", "text/plain", {}};
  question.path += "?deviation=" + JsonLine(Json(request.ground_deviation_m)) +
                   "&actor=" + EncodeForQuery(request.actor) +
                   "&file=" + EncodeForQuery(request.ground_points_path) +
                   (request.forget_ground_points ? "&forget=yes" : "");
  question.body = {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
  VEDUTA_ASSIGN_OR_RETURN(const Json json, AskForJson(daemon, question));
  GeoreferenceAnswer brought;
  brought.points_read = json.value("points_read", 0u);
  brought.unknown_photos = json.value("unknown_photos", std::vector<std::string>());
  if (const Json told = json.value("coordinates", Json()); told.is_object()) {
    GroundCoordinates& coordinates = brought.coordinates.emplace();
    coordinates.name = told.value("name", std::string());
    coordinates.operation = told.value("operation", std::string());
    const Json accuracy_m = told.value("accuracy_m", Json());
    if (accuracy_m.is_number()) coordinates.accuracy_m = accuracy_m.get<double>();
  }
  return brought;
}

}  // namespace veduta
