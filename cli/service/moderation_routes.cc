// SPDX-License-Identifier: Apache-2.0
#include "cli/service/moderation_routes.h"

#include <limits>

#include "cli/service/path_numbers.h"
#include "cli/service/request_parts.h"
#include "cli/wire/moderation_json.h"

namespace veduta {
namespace {

template <typename T>
HttpAnswer AnswerOf(const Result<T>& result) {
  return result.ok() ? JsonAnswer(200, ToJson(*result)) : ProblemOf(result.status());
}

Result<HideRequest> HideOf(const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  HideRequest wanted;
  const Json photos = json.value("photos", Json::array());
  if (!photos.is_array()) return Status::InvalidArgument("'photos' is no array");
  for (const Json& photo : photos) {
    if (!photo.is_string()) return Status::InvalidArgument("'photos' has what is no text");
    wanted.photos.push_back(photo.get<std::string>());
  }
  VEDUTA_ASSIGN_OR_RETURN(
      const uint64_t contribution,
      OptionalNumber(json, "contribution", std::numeric_limits<uint32_t>::max()));
  wanted.contribution = static_cast<uint32_t>(contribution);
  VEDUTA_ASSIGN_OR_RETURN(wanted.actor, ActorOf(json, request));
  VEDUTA_ASSIGN_OR_RETURN(wanted.reason, OptionalText(json, "reason"));
  return wanted;
}

template <Status (Engine::*kState)(const HideRequest&)>
HttpAnswer HideOrShow(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<HideRequest> wanted = HideOf(request);
  if (!wanted.ok()) return ProblemOf(wanted.status());
  const Status done = (engine->*kState)(*wanted);
  return done.ok() ? JsonAnswer(200, Json::object()) : ProblemOf(done);
}

// What the page must know of whoever looks at it, to show what they may do.
HttpAnswer TellMe(Engine*, const HttpRequest& request, const PathArguments&) {
  const Sight& sight = request.sight;
  const bool is_part = sight.contribution != 0;
  return JsonAnswer(200, {{"name", request.who.empty() ? Json(nullptr) : Json(request.who)},
                          {"role", request.role ? Json(RoleWord(*request.role)) : Json(nullptr)},
                          {"contribution", is_part ? Json(sight.contribution) : Json(nullptr)},
                          {"reconstruction", ToJson(sight.reconstruction)}});
}

HttpAnswer ListHidden(Engine* engine, const HttpRequest&, const PathArguments&) {
  return AnswerOf(engine->Ask().Hidden());
}

Result<uint32_t> ReportOf(Engine* engine, const HttpRequest& request, const std::string& photo) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  ReportRequest report;
  report.photo = photo;
  VEDUTA_ASSIGN_OR_RETURN(const std::string reason, TextMember(json, "reason"));
  VEDUTA_ASSIGN_OR_RETURN(report.reason, ParseReportReason(reason));
  VEDUTA_ASSIGN_OR_RETURN(report.text, OptionalText(json, "text"));
  report.reporter = request.who;
  if (request.is_of_owner) {
    VEDUTA_ASSIGN_OR_RETURN(report.reporter, OptionalText(json, "reporter"));
  }
  if (report.reporter.empty()) report.reporter = "anonymous";
  return engine->Report(report, request.sight);
}

HttpAnswer ReportPhoto(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  if (request.content_type != "application/json")
    return Problem(415, "the content type is '" + request.content_type +
                            "': a report is sent as application/json");
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<uint32_t> number = ReportOf(engine, request, arguments[0]);
  return number.ok() ? JsonAnswer(201, {{"report", *number}}) : ProblemOf(number.status());
}

HttpAnswer ListReports(Engine* engine, const HttpRequest& request, const PathArguments&) {
  const std::string state = Parameter(request, "state", "open");
  if (state != "open" && state != "all")
    return Problem(400, "the parameter 'state' is '" + state + "', and must be open or all");
  return AnswerOf(engine->Ask().Reports(state == "open"));
}

HttpAnswer DismissReport(Engine* engine, const HttpRequest& request,
                         const PathArguments& arguments) {
  const auto number =
      WholeNumber("a report's number", arguments[0], 1, std::numeric_limits<uint32_t>::max());
  if (!number.ok()) return ProblemOf(number.status());
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<Json> json = JsonObjectOf(request);
  if (!json.ok()) return ProblemOf(json.status());
  const Result<std::string> actor = ActorOf(*json, request);
  if (!actor.ok()) return ProblemOf(actor.status());
  const Status done = engine->DismissReport(static_cast<uint32_t>(*number), *actor);
  return done.ok() ? JsonAnswer(200, Json::object()) : ProblemOf(done);
}

}  // namespace

bool IsReport(const HttpRequest& request) {
  return request.method == "POST" && request.path.size() == 4 && request.path[1] == "photos" &&
         request.path[3] == "report";
}

std::vector<CityRoute> ModerationRoutes() {
  constexpr Role kCurates = Role::kCurator;
  return {
      {"GET", {"v1", "me"}, {}, TellMe, false, true},
      {"POST", {"v1", "photos", "*", "report"}, {}, ReportPhoto},
      {"GET", {"v1", "reports"}, {"state"}, ListReports, false, false, kCurates, true},
      {"POST", {"v1", "reports", "*", "dismiss"}, {}, DismissReport, false, false, kCurates, true},
      {"GET", {"v1", "hidden"}, {}, ListHidden, false, false, kCurates, true},
      {"POST", {"v1", "hidden"}, {}, HideOrShow<&Engine::Hide>, false, false, kCurates, true},
      {"POST", {"v1", "shown"}, {}, HideOrShow<&Engine::Unhide>, false, false, kCurates, true},
  };
}

}  // namespace veduta
