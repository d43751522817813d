// SPDX-License-Identifier: Apache-2.0
#include "cli/service/city_routes.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <set>

#include "cli/service/accepted_type.h"
#include "cli/service/contribution_routes.h"
#include "cli/service/link_routes.h"
#include "cli/service/moderation_routes.h"
#include "cli/service/openapi.h"
#include "cli/service/owner_commands.h"
#include "cli/service/page_answer.h"
#include "cli/service/path_numbers.h"
#include "cli/service/request_parts.h"
#include "cli/service/stac_routes.h"
#include "cli/service/surface_answers.h"
#include "cli/service/token_routes.h"
#include "cli/wire/added_json.h"
#include "cli/wire/answers_json.h"
#include "cli/wire/earth_json.h"
#include "cli/wire/place_text.h"

namespace veduta {
namespace {

// Entries of the journal in one answer, at most and by default. Chosen by hand.
constexpr uint64_t kJournalCountMax = 1000;
// Candidates that may be asked for, and that are told by default: as `veduta neighbors` does.
constexpr uint64_t kCandidatesMax = 100'000, kCandidatesDefault = 20;

// Photos in one answer, at most and by default; sides of small pictures, px. Chosen by hand.
constexpr uint64_t kPhotosCountMax = 1000, kThumbnailSide = 256, kThumbnailSideMin = 16;

template <typename T>
HttpAnswer AnswerOf(const Result<T>& result) {
  return result.ok() ? JsonAnswer(200, ToJson(*result)) : ProblemOf(result.status());
}

HttpAnswer GetStatus(Engine* engine, const HttpRequest& request, const PathArguments&) {
  return AnswerOf(engine->Ask(request.sight).Status());
}

HttpAnswer ListCameras(Engine* engine, const HttpRequest& request, const PathArguments&) {
  return AnswerOf(engine->Ask(request.sight).Cameras());
}

HttpAnswer GetCamera(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  return AnswerOf(engine->Ask(request.sight).Camera(arguments[0]));
}

Result<CameraAnswer> AddCameraOf(Engine* engine, const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  VEDUTA_ASSIGN_OR_RETURN(const std::string name, TextMember(json, "name"));
  VEDUTA_ASSIGN_OR_RETURN(const std::string size, TextMember(json, "size"));
  VEDUTA_ASSIGN_OR_RETURN(const std::string params, TextMember(json, "params"));
  VEDUTA_ASSIGN_OR_RETURN(const CameraModel model, ParseCamera(size, params));
  VEDUTA_ASSIGN_OR_RETURN([[maybe_unused]] const CameraId id,
                          engine->AddCamera(name, model, "sent to the daemon"));
  return engine->Ask().Camera(name);
}

HttpAnswer AddCamera(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (request.content_type != "application/json")
    return Problem(415, "the content type is '" + request.content_type +
                            "': a camera is sent as application/json");
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<CameraAnswer> camera = AddCameraOf(engine, request);
  return camera.ok() ? JsonAnswer(201, ToJson(*camera)) : ProblemOf(camera.status());
}

// How sure a photo's pose is takes hundreds of times as long to tell as all else that is known of
// it, so it has an address of its own, and no key elsewhere.
HttpAnswer WithoutUncertainty(Json json) {
  json.erase("uncertainty");
  return JsonAnswer(200, json);
}

HttpAnswer GetPhoto(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  const Result<ImageAnswer> image = engine->Ask(request.sight).Image(arguments[0]);
  return image.ok() ? WithoutUncertainty(ToJson(*image)) : ProblemOf(image.status());
}

// As OGC has it; in the rotation's other form where `form` is "ypr".
HttpAnswer GeoPoseAnswer(const HttpRequest& request, const ImageAnswer& image,
                         const std::string& form) {
  if (!image.on_earth) {
    return Problem(
        404, image.name + (image.cam_from_world ? " has a pose in reconstruction " +
                                                      std::to_string(image.reconstruction.value) +
                                                      ", whose place on the earth is not known"
                                                : " has no pose that could be told"));
  }
  HttpAnswer answer = JsonAnswer(
      200, form == "ypr" ? GeoPoseYprJson(*image.on_earth) : GeoPoseJson(*image.on_earth));
  if (PrefersGeoPose(HeaderOf(request, "Accept"))) answer.content_type = kGeoPoseType;
  answer.headers.emplace_back("Vary", "Accept");
  return answer;
}

HttpAnswer GetPose(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  const Result<ImageAnswer> image = engine->Ask(request.sight).Image(arguments[0]);
  if (!image.ok()) return ProblemOf(image.status());
  if (PrefersGeoPose(HeaderOf(request, "Accept")))
    return GeoPoseAnswer(request, *image, "quaternion");
  if (image->may_stand_in.empty() && image->cam_from_world) {
    HttpAnswer answer = WithoutUncertainty(PoseJson(*image));
    answer.headers.emplace_back("Vary", "Accept");
    return answer;
  }
  return Problem(
      404, image->name + " has no pose that could be told: " +
               (image->cam_from_world ? "it may stand at another place as well that looks alike"
                                      : ReasonSentence(image->reason, image->detail)));
}

HttpAnswer GetGeoPose(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  const std::string form = Parameter(request, "form", "quaternion");
  if (form != "quaternion" && form != "ypr")
    return Problem(400, "the parameter 'form' is '" + form + "', and must be quaternion or ypr");
  const Result<ImageAnswer> image = engine->Ask(request.sight).Image(arguments[0]);
  return image.ok() ? GeoPoseAnswer(request, *image, form) : ProblemOf(image.status());
}

HttpAnswer GetGeoreference(Engine* engine, const HttpRequest& request, const PathArguments&) {
  return AnswerOf(engine->Ask(request.sight).Georeference());
}

HttpAnswer GetUncertainty(Engine* engine, const HttpRequest& request,
                          const PathArguments& arguments) {
  const auto uncertainty = engine->Ask(request.sight).Uncertainty(arguments[0]);
  if (!uncertainty.ok()) return ProblemOf(uncertainty.status());
  if (*uncertainty) return JsonAnswer(200, ToJson(**uncertainty));
  return Problem(404, arguments[0] + " has no pose, or too little is seen to tell how sure it is");
}

HttpAnswer GetNeighbors(Engine* engine, const HttpRequest& request,
                        const PathArguments& arguments) {
  return AnswerOf(engine->Ask(request.sight).Neighbors(arguments[0]));
}

// The photo that the request carries.
PhotoSource PhotoOf(const HttpRequest& request) {
  return {Parameter(request, "name", "the photo"), "", request.body};
}

HttpAnswer RankPhoto(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (auto refusal = RefuseBody(request)) return *std::move(refusal);
  const auto count = NumberParameter(request, "count", kCandidatesDefault, 1, kCandidatesMax);
  if (!count.ok()) return ProblemOf(count.status());
  const auto ranked =
      engine->Ask(request.sight)
          .Rank(PhotoOf(request), Parameter(request, "camera"), static_cast<uint32_t>(*count));
  return ranked.ok() ? JsonAnswer(200, CandidatesJson(*ranked)) : ProblemOf(ranked.status());
}

HttpAnswer LocalizePhoto(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (auto refusal = RefuseBody(request)) return *std::move(refusal);
  LocalizeRequest photo{PhotoOf(request), Parameter(request, "camera"), Parameter(request, "near")};
  if (const std::string place = Parameter(request, "place"); !place.empty()) {
    photo.near_place = ParsePlace(place);
    if (!photo.near_place)
      return ProblemOf(Status::InvalidArgument("the parameter 'place' is '" + place +
                                               "', and must be LATITUDE,LONGITUDE in degrees"));
  }
  HttpAnswer answer;
  const Status done =
      engine->Ask(request.sight).Localize({&photo, 1}, [&](const LocalizedPhoto& localized) {
        answer = localized.failure.ok() ? JsonAnswer(200, ToJson(localized))
                                        : ProblemOf(localized.failure);
      });
  return done.ok() ? answer : ProblemOf(done);
}

Result<ForbidRequest> StatementOf(const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  static const std::map<std::string, ForbidKind> kKinds = {
      {"pair", ForbidKind::kPair}, {"merge", ForbidKind::kMerge}, {"pose", ForbidKind::kPose}};
  VEDUTA_ASSIGN_OR_RETURN(const std::string kind, TextMember(json, "kind"));
  const auto found = kKinds.find(kind);
  if (found == kKinds.end())
    return Status::InvalidArgument("the kind is '" + kind + "', and must be pair, merge or pose");
  ForbidRequest statement;
  statement.kind = found->second;
  VEDUTA_ASSIGN_OR_RETURN(statement.a, TextMember(json, "a"));
  VEDUTA_ASSIGN_OR_RETURN(statement.b, OptionalText(json, "b"));
  VEDUTA_ASSIGN_OR_RETURN(statement.actor, ActorOf(json, request));
  VEDUTA_ASSIGN_OR_RETURN(statement.reason, OptionalText(json, "reason"));
  return statement;
}

template <Status (Engine::*kState)(const ForbidRequest&)>
HttpAnswer StateFact(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<ForbidRequest> statement = StatementOf(request);
  if (!statement.ok()) return ProblemOf(statement.status());
  const Status stated = (engine->*kState)(*statement);
  return stated.ok() ? JsonAnswer(200, Json::object()) : ProblemOf(stated);
}

HttpAnswer ListUploads(Engine* engine, const HttpRequest& request, const PathArguments&) {
  return AnswerOf(engine->Ask(request.sight).Uploads());
}

HttpAnswer ListReconstructions(Engine* engine, const HttpRequest& request, const PathArguments&) {
  return AnswerOf(engine->Ask(request.sight).Reconstructions());
}

HttpAnswer GetReconstruction(Engine* engine, const HttpRequest& request,
                             const PathArguments& arguments) {
  const auto id = ReconstructionNumber(arguments[0]);
  if (!id.ok()) return ProblemOf(id.status());
  const Questions ask = engine->Ask(request.sight);
  const auto found = ask.Reconstruction(*id);
  if (!found.ok()) return ProblemOf(found.status());
  const auto hypotheses = ask.Hypotheses(found->id);
  if (!hypotheses.ok()) return ProblemOf(hypotheses.status());
  return JsonAnswer(200, ReconstructionJson(*found, *hypotheses));
}

HttpAnswer ListPhotos(Engine* engine, const HttpRequest& request, const PathArguments&) {
  const auto from = NumberParameter(request, "from", 1, 1, std::numeric_limits<uint32_t>::max());
  if (!from.ok()) return ProblemOf(from.status());
  const auto count = NumberParameter(request, "count", kPhotosCountMax, 1, kPhotosCountMax);
  if (!count.ok()) return ProblemOf(count.status());
  return AnswerOf(
      engine->Ask(request.sight)
          .Images(ImageId(static_cast<uint32_t>(*from)), static_cast<uint32_t>(*count)));
}

HttpAnswer FileAnswer(const Result<PhotoFile>& file) {
  if (!file.ok()) return ProblemOf(file.status());
  return {200, file->media_type, {file->bytes.begin(), file->bytes.end()}, {}};
}

HttpAnswer GetFile(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  return FileAnswer(engine->Ask(request.sight).Photo(arguments[0]));
}

HttpAnswer GetOriginal(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  return FileAnswer(engine->Ask(request.sight).Original(arguments[0]));
}

HttpAnswer GetThumbnail(Engine* engine, const HttpRequest& request,
                        const PathArguments& arguments) {
  const auto side =
      NumberParameter(request, "side", kThumbnailSide, kThumbnailSideMin, kThumbnailSideMax);
  if (!side.ok()) return ProblemOf(side.status());
  return FileAnswer(
      engine->Ask(request.sight).Thumbnail(arguments[0], static_cast<uint32_t>(*side)));
}

// 16 bytes for each point, little-endian: x, y, z as 32-bit floats, red, green, blue, 0.
std::string PointBytes(const PointCloud& cloud) {
  std::string bytes;
  bytes.reserve(16 * cloud.positions.size());
  for (size_t i = 0; i < cloud.positions.size(); ++i) {
    bytes.append(reinterpret_cast<const char*>(cloud.positions[i].data()), 12);
    bytes.append(reinterpret_cast<const char*>(cloud.rgb[i].data()), 3);
    bytes += '\0';
  }
  return bytes;
}

HttpAnswer GetPoints(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  const auto id = ReconstructionNumber(arguments[0]);
  if (!id.ok()) return ProblemOf(id.status());
  const auto cloud = engine->Ask(request.sight).Points(*id);
  if (!cloud.ok()) return ProblemOf(cloud.status());
  return {200, "application/octet-stream", PointBytes(*cloud), {}};
}

Result<GeoreferenceRequest> GeoreferenceOf(const HttpRequest& request) {
  GeoreferenceRequest wanted;
  if (!request.body.empty()) {
    wanted.ground_points.emplace(request.body.begin(), request.body.end());
    wanted.ground_points_path = Parameter(request, "file");  // for messages; nothing is read there
  }
  wanted.forget_ground_points = Parameter(request, "forget") == "yes";
  wanted.actor = request.who.empty() ? Parameter(request, "actor", "anonymous") : request.who;
  const std::string deviation = Parameter(request, "deviation");
  if (deviation.empty()) return wanted;
  const char* const end = deviation.data() + deviation.size();
  const auto [rest, error] = std::from_chars(deviation.data(), end, wanted.ground_deviation_m);
  if (error == std::errc() && rest == end) return wanted;
  return Status::InvalidArgument("the parameter 'deviation' is '" + deviation +
                                 "', and must be a number of metres");
}

HttpAnswer SetGeoreference(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (request.body.empty() && Parameter(request, "forget") != "yes")
    return Problem(400, "there are no surveyed points: send a file, or 'forget=yes'");
  if (!request.body.empty() && request.content_type != "text/plain")
    return Problem(415, "the content type is '" + request.content_type +
                            "': surveyed points are sent as text/plain");
  const Result<GeoreferenceRequest> wanted = GeoreferenceOf(request);
  if (!wanted.ok()) return ProblemOf(wanted.status());
  return AnswerOf(engine->Georeference(*wanted));
}

HttpAnswer ListHypotheses(Engine* engine, const HttpRequest& request, const PathArguments&) {
  return AnswerOf(engine->Ask(request.sight).Hypotheses());
}

HttpAnswer GetJournal(Engine* engine, const HttpRequest& request, const PathArguments&) {
  const auto from = NumberParameter(request, "from", 0, 0, std::numeric_limits<uint64_t>::max());
  if (!from.ok()) return ProblemOf(from.status());
  const auto count = NumberParameter(request, "count", kJournalCountMax, 1, kJournalCountMax);
  if (!count.ok()) return ProblemOf(count.status());
  return AnswerOf(engine->Ask(request.sight).Journal(*from, static_cast<uint32_t>(*count)));
}

HttpAnswer GetOpenApi(Engine* /*engine*/, const HttpRequest&, const PathArguments&) {
  static const HttpAnswer kDocument = JsonAnswer(200, OpenApi(ListRoutes()));
  return kDocument;
}

std::vector<CityRoute> RoutesOfCity() {
  constexpr Role kSends = Role::kContributor, kCurates = Role::kCurator, kRules = Role::kAdmin;
  const std::vector<std::string> of_photo = {"name", "camera", "contributor", "contribution"};
  return {
      {"GET", {}, {}, AnswerWithPage, false, true, Role::kViewer, false, true},
      {"GET", {"page.js"}, {}, AnswerWithPage, false, true, Role::kViewer, false, true},
      {"GET", {"page.css"}, {}, AnswerWithPage, false, true, Role::kViewer, false, true},
      {"GET", {"healthz"}, {}, nullptr, false, true, Role::kViewer, false, true},
      {"GET", {"readyz"}, {}, nullptr, false, true, Role::kViewer, false, true},
      {"GET", {"metrics"}, {}, nullptr},
      {"GET", {"v1", "openapi.json"}, {}, GetOpenApi, false, true, Role::kViewer, false, true},
      {"GET", {"v1", "events"}, {"from"}, nullptr},
      {"GET", {"v1", "photos"}, {"from", "count"}, ListPhotos, true},
      {"POST", {"v1", "photos"}, of_photo, nullptr, false, false, kSends},
      {"GET", {"v1", "dense"}, {}, nullptr, false, true},
      {"POST", {"v1", "dense", "pause"}, {}, nullptr, false, false, kCurates},
      {"POST", {"v1", "dense", "resume"}, {}, nullptr, false, false, kCurates},
      {"GET", {"v1", "uploads"}, {}, ListUploads, true, false, kSends},
      {"GET", {"v1", "uploads", "*"}, {}, nullptr, false, true, kSends},
      {"GET", {"v1", "status"}, {}, GetStatus},
      {"GET", {"v1", "cameras"}, {}, ListCameras, true},
      {"POST", {"v1", "cameras"}, {}, AddCamera, false, false, kCurates},
      {"GET", {"v1", "cameras", "*"}, {}, GetCamera, true},
      {"GET", {"v1", "photos", "*"}, {}, GetPhoto, true, true},
      {"GET", {"v1", "photos", "*", "pose"}, {}, GetPose, true, true},
      {"GET", {"v1", "photos", "*", "geopose"}, {"form"}, GetGeoPose, true, true},
      {"GET", {"v1", "photos", "*", "uncertainty"}, {}, GetUncertainty, true},
      {"GET", {"v1", "photos", "*", "file"}, {}, GetFile, true, false, kCurates},
      {"GET", {"v1", "photos", "*", "original"}, {}, GetOriginal, true, false, kRules, true},
      {"GET", {"v1", "photos", "*", "thumbnail"}, {"side"}, GetThumbnail, true},
      {"GET", {"v1", "photos", "*", "neighbors"}, {}, GetNeighbors, true, true},
      {"POST", {"v1", "candidates"}, {"name", "camera", "count"}, RankPhoto},
      {"POST", {"v1", "localize"}, {"name", "camera", "near", "place"}, LocalizePhoto},
      {"GET", {"v1", "reconstructions"}, {}, ListReconstructions, true},
      {"GET", {"v1", "reconstructions", "*"}, {}, GetReconstruction, true},
      {"GET", {"v1", "reconstructions", "*", "points"}, {}, GetPoints, true},
      {"GET", {"v1", "reconstructions", "*", "surface", "tileset.json"}, {}, AnswerWithTileset},
      {"GET", {"v1", "reconstructions", "*", "surface", "tiles", "*"}, {}, AnswerWithSurfaceTile},
      {"GET", {"v1", "georeference"}, {}, GetGeoreference, true},
      {"POST",
       {"v1", "georeference"},
       {"deviation", "forget", "actor", "file"},
       SetGeoreference,
       false,
       false,
       kCurates,
       true},
      {"GET", {"v1", "hypotheses"}, {}, ListHypotheses, true},
      {"GET", {"v1", "journal"}, {"from", "count"}, GetJournal, true},
      {"POST", {"v1", "removals"}, {}, nullptr, false, false, kCurates, true},
      {"POST", {"v1", "forbidden"}, {}, StateFact<&Engine::Forbid>, false, false, kCurates, true},
      {"POST", {"v1", "allowed"}, {}, StateFact<&Engine::Allow>, false, false, kCurates, true},
  };
}

const std::vector<CityRoute>& Routes() {
  static const std::vector<CityRoute> kRoutes = [] {
    std::vector<CityRoute> all = RoutesOfCity();
    for (const CityRoute& route : ContributionRoutes()) all.push_back(route);
    for (const CityRoute& route : LinkRoutes()) all.push_back(route);
    for (const CityRoute& route : ModerationRoutes()) all.push_back(route);
    for (const CityRoute& route : TokenRoutes()) all.push_back(route);
    for (const CityRoute& route : StacRoutes()) all.push_back(route);
    for (const CityRoute& route : OwnerRoutes()) all.push_back(route);
    return all;
  }();
  return kRoutes;
}

// Whether the path is one of the route's; `arguments` receives what stands for "*".
bool Fits(const CityRoute& route, const std::vector<std::string>& path, PathArguments* arguments) {
  if (route.path.size() != path.size()) return false;
  for (size_t i = 0; i < path.size(); ++i) {
    if (route.path[i] == "*") {
      arguments->push_back(path[i]);
    } else if (route.path[i] != path[i]) {
      return false;
    }
  }
  return true;
}

HttpAnswer WrongMethod(const std::string& method, const std::set<std::string>& right) {
  std::string methods;
  for (const std::string& one : right) methods += (methods.empty() ? "" : ", ") + one;
  HttpAnswer answer = Problem(405, method + " does nothing here; " + methods + " does");
  answer.headers.emplace_back("Allow", methods);
  return answer;
}

}  // namespace

std::span<const CityRoute> ListRoutes() {
  return Routes();
}

std::variant<RouteMatch, HttpAnswer> FindRoute(const HttpRequest& request) {
  std::set<std::string> right_methods;
  for (const CityRoute& route : Routes()) {
    RouteMatch match{&route, {}};
    if (!Fits(route, request.path, &match.arguments)) continue;
    if (request.method != route.method) {
      right_methods.insert(route.method);
      continue;
    }
    for (const auto& [name, value] : request.query) {
      if (std::ranges::find(route.parameters, name) == route.parameters.end())
        return Problem(400, "there is no parameter '" + name + "' here");
    }
    return match;
  }
  if (!right_methods.empty()) return WrongMethod(request.method, right_methods);
  std::string path;
  for (const std::string& part : request.path) path += "/" + part;
  return Problem(404, "there is nothing at " + path);
}

}  // namespace veduta
