// SPDX-License-Identifier: Apache-2.0
#include "cli/service/openapi.h"

#include <algorithm>

#include "cli/service/tus_message.h"
#include "cli/wire/stac_json.h"

namespace veduta {
namespace {

enum class Body : uint8_t { kNone, kPhoto, kJson, kText, kPart };

struct Description {
  const char *method, *path, *summary;
  Body body = Body::kNone;
  uint32_t code = 200;  // of success
  const char* media_type = "application/json";
};

constexpr const char *kBinary = "application/octet-stream", *kText = "text/plain";

constexpr Description kDescriptions[] = {
    {"GET", "/", "The page, for people", Body::kNone, 200, "text/html"},
    {"GET", "/page.js", "Its script", Body::kNone, 200, "text/javascript"},
    {"GET", "/page.css", "Its style", Body::kNone, 200, "text/css"},
    {"GET", "/healthz", "Whether the daemon is alive"},
    {"GET", "/readyz", "Whether the daemon takes photos"},
    {"GET", "/metrics", "Counts for Prometheus", Body::kNone, 200, kText},
    {"GET", "/v1/openapi.json", "This document"},
    {"GET", "/v1/events", "The journal as it grows", Body::kNone, 200, "text/event-stream"},
    {"GET", "/v1/photos", "Images from a number on, ascending"},
    {"POST", "/v1/photos", "Add a photo", Body::kPhoto, 201},
    {"GET", "/v1/dense", "The dense pass"},
    {"POST", "/v1/dense/pause", "Pause the dense pass"},
    {"POST", "/v1/dense/resume", "Go on with the dense pass"},
    {"GET", "/v1/uploads", "Photos that wait for their turn"},
    {"GET", "/v1/uploads/{upload}", "What became of a photo that was sent"},
    {"OPTIONS", "/v1/tus", "What of the tus protocol 1.0.0 is there", Body::kNone, 204, ""},
    {"POST", "/v1/tus", "Begin an upload in parts, by the tus protocol", Body::kPart, 201},
    {"GET", "/v1/tus/{tus}", "How far an upload in parts has come; HEAD for its offset alone"},
    {"PATCH", "/v1/tus/{tus}", "The next part of it", Body::kPart, 204, ""},
    {"DELETE", "/v1/tus/{tus}", "Give it up", Body::kNone, 204, ""},
    {"GET", "/v1/contributions", "Contributions from a number on, ascending"},
    {"POST", "/v1/contributions", "Open a contribution: photos that are sent together", Body::kJson,
     201},
    {"GET", "/v1/contributions/{contribution}", "One, with the verdicts of its photos in sum"},
    {"DELETE", "/v1/contributions/{contribution}", "Take it out with its photos"},
    {"GET", "/v1/contributions/{contribution}/photos", "Its photos, from an upload's number on"},
    {"POST", "/v1/contributions/{contribution}/close", "It takes no photo any more"},
    {"GET", "/v1/status", "Counts, reconstructions, backlog"},
    {"GET", "/v1/cameras", "The cameras"},
    {"POST", "/v1/cameras", "Add a camera", Body::kJson, 201},
    {"GET", "/v1/cameras/{camera}", "One camera, by its name"},
    {"GET", "/v1/photos/{photo}", "One photo: verdict, reason, reconstruction, neighbours"},
    {"GET", "/v1/photos/{photo}/pose", "Where a photo was taken"},
    {"GET", "/v1/photos/{photo}/geopose", "Where on the earth, as an OGC GeoPose"},
    {"GET", "/v1/photos/{photo}/uncertainty", "How sure its pose is"},
    {"GET", "/v1/photos/{photo}/file", "The photo as it came", Body::kNone, 200, "image/*"},
    {"GET", "/v1/photos/{photo}/original", "What came, of a photo in which areas are filled",
     Body::kNone, 200, "image/*"},
    {"GET", "/v1/photos/{photo}/thumbnail", "A small picture of it", Body::kNone, 200,
     "image/jpeg"},
    {"GET", "/v1/photos/{photo}/neighbors", "Its verified neighbours"},
    {"POST", "/v1/photos/{photo}/report", "Tell the curators that something is wrong with it",
     Body::kJson, 201},
    {"GET", "/v1/me", "Whose the token is, and its role"},
    {"GET", "/v1/reports", "What people have reported"},
    {"POST", "/v1/reports/{report}/dismiss", "The photo stays as it is", Body::kJson},
    {"GET", "/v1/hidden", "What curators have hidden"},
    {"POST", "/v1/hidden", "Hide photos, or a contribution", Body::kJson},
    {"POST", "/v1/shown", "Take back what was hidden", Body::kJson},
    {"POST", "/v1/candidates", "Stored photos that look like this one", Body::kPhoto},
    {"POST", "/v1/localize", "Where a photo was taken that is not added", Body::kPhoto},
    {"GET", "/v1/reconstructions", "Living reconstructions, largest first"},
    {"GET", "/v1/reconstructions/{reconstruction}", "One reconstruction"},
    {"GET", "/v1/reconstructions/{reconstruction}/points",
     "Its sparse points, 16 bytes each: x, y, z as 32-bit floats, red, green, blue, 0", Body::kNone,
     200, kBinary},
    {"GET", "/v1/reconstructions/{reconstruction}/surface/tileset.json",
     "Its dense surface as OGC 3D Tiles 1.1"},
    {"GET", "/v1/reconstructions/{reconstruction}/surface/tiles/{tile}",
     "A content of that tileset, NAME.glb, which never changes", Body::kNone, 200,
     "model/gltf-binary"},
    {"GET", "/v1/stac", "The photos as a STAC API: its landing page"},
    {"GET", "/v1/stac/conformance", "What of STAC and OGC API Features is there"},
    {"GET", "/v1/stac/collections", "Its collections, which is one"},
    {"GET", "/v1/stac/collections/{collection}", "The collection of photos"},
    {"GET", "/v1/stac/collections/{collection}/items", "Photos by when and where", Body::kNone, 200,
     kGeoJson},
    {"GET", "/v1/stac/collections/{collection}/items/{item}", "A photo as an item", Body::kNone,
     200, kGeoJson},
    {"GET", "/v1/stac/search", "Photos by when and where", Body::kNone, 200, kGeoJson},
    {"POST", "/v1/stac/search", "The same, by a JSON object", Body::kJson, 200, kGeoJson},
    {"GET", "/v1/georeference", "Where the city is on the earth"},
    {"POST", "/v1/georeference", "Take surveyed points in, as ODM's gcp_list.txt", Body::kText},
    {"GET", "/v1/hypotheses", "Merges that are proposed and not believed yet"},
    {"GET", "/v1/journal", "What was done, by whom"},
    {"POST", "/v1/removals", "Take photos out", Body::kJson},
    {"POST", "/v1/forbidden", "State that two are not the same place", Body::kJson},
    {"POST", "/v1/allowed", "Take back what was forbidden", Body::kJson},
    {"GET", "/v1/tokens", "The tokens that were made"},
    {"POST", "/v1/tokens", "Make a token", Body::kJson, 201},
    {"POST", "/v1/tokens/{token}/revoke", "Revoke a token", Body::kJson},
    {"GET", "/v1/links", "The links for reading that were made"},
    {"POST", "/v1/links", "Make a link that lets whoever has it read", Body::kJson, 201},
    {"POST", "/v1/links/{link}/revoke", "Revoke a link", Body::kJson},
    {"POST", "/v1/settle", "Do what follows from the photos there are", Body::kJson},
    {"POST", "/v1/cameras/calibrate", "Calibrate the cameras of photos that wait for theirs",
     Body::kJson},
    {"POST", "/v1/densify", "The dense pass, now", Body::kJson},
    {"POST", "/v1/vocabulary/train", "Train a vocabulary", Body::kJson},
    {"POST", "/v1/vocabulary/import", "Use a given vocabulary", Body::kJson},
    {"POST", "/v1/models", "Make a reconstruction of a model of COLMAP", Body::kJson},
    {"POST", "/v1/backups", "Add a backup to a folder of them", Body::kJson},
    {"POST", "/v1/copies", "Make a copy that opens on its own", Body::kJson}};

// What stands for anything after this part of a path: "photo" after "photos".
std::string ParameterName(const std::string& part) {
  return part == "tus" ? part : part.substr(0, part.size() - 1);
}

Description DescriptionOf(const CityRoute& route) {
  const std::string path = PathTemplate(route);
  for (const Description& one : kDescriptions) {
    if (path == one.path && std::string(route.method) == one.method) return one;
  }
  return {route.method, "", ""};
}

Json BinarySchema() {
  return {{"schema", {{"type", "string"}, {"format", "binary"}}}};
}

// Photos by any names of fields, and the parameters of the query as fields.
Json FormSchema() {
  const Json text = {{"type", "string"}};
  return {{"type", "object"},
          {"properties",
           {{"name", text}, {"camera", text}, {"contributor", text}, {"contribution", text}}},
          {"additionalProperties", BinarySchema()["schema"]}};
}

Json BodyOf(Body body, bool is_form) {
  Json content;
  if (body == Body::kPhoto) {
    content["image/*"] = BinarySchema();
    content[kBinary] = BinarySchema();
    if (is_form) content["multipart/form-data"] = {{"schema", FormSchema()}};
  } else if (body == Body::kText) {
    content[kText] = {{"schema", {{"type", "string"}}}};
  } else if (body == Body::kPart) {
    content[kTusContentType] = BinarySchema();
  } else {
    content["application/json"] = {{"schema", {{"type", "object"}}}};
  }
  const bool is_needed = body == Body::kPhoto || body == Body::kJson;
  return {{"required", is_needed}, {"content", std::move(content)}};
}

// Whether a part of the answer may be asked for, as CutToRange has it.
bool HasRanges(const CityRoute& route, const Description& description) {
  const std::string type = description.media_type;
  return std::string(route.method) == "GET" && !type.ends_with("json") &&
         type != "text/event-stream";
}

// Whether it is answered by 304 to who has it.
bool HasTag(const CityRoute& route) {
  return route.is_of_snapshot || std::ranges::find(route.path, "surface") != route.path.end();
}

bool AddsPhoto(const CityRoute& route) {
  return std::string(route.method) == "POST" && PathTemplate(route) == "/v1/photos";
}

// Headers that a request may have, or must, where the value is true.
std::vector<std::pair<const char*, bool>> HeadersOf(const CityRoute& route,
                                                    const Description& description) {
  std::vector<std::pair<const char*, bool>> headers;
  if (HasRanges(route, description)) headers.emplace_back("Range", false);
  if (HasTag(route)) headers.emplace_back("If-None-Match", false);
  if (AddsPhoto(route)) headers.emplace_back("Prefer", false);
  if (PathTemplate(route) == "/v1/events") headers.emplace_back("Last-Event-ID", false);
  const std::string method = route.method;
  if (route.path.size() < 2 || route.path[1] != "tus" || method == "OPTIONS") return headers;
  headers.emplace_back("Tus-Resumable", method != "GET");
  if (method == "POST") {
    headers.emplace_back("Upload-Length", true);
    headers.emplace_back("Upload-Metadata", true);
  }
  if (method == "PATCH") headers.emplace_back("Upload-Offset", true);
  if (description.body == Body::kPart) headers.emplace_back("Upload-Checksum", false);
  return headers;
}

Json ParametersOf(const CityRoute& route, const Description& description) {
  Json parameters = Json::array();
  for (size_t i = 1; i < route.path.size(); ++i) {
    if (route.path[i] != "*") continue;
    parameters.push_back({{"name", ParameterName(route.path[i - 1])},
                          {"in", "path"},
                          {"required", true},
                          {"schema", {{"type", "string"}}}});
  }
  for (const std::string& name : route.parameters) {
    const bool is_number = name == "from" || name == "count" || name == "side" || name == "limit";
    parameters.push_back({{"name", name},
                          {"in", "query"},
                          {"schema", {{"type", is_number ? "integer" : "string"}}}});
  }
  for (const auto& [name, is_needed] : HeadersOf(route, description)) {
    parameters.push_back({{"name", name},
                          {"in", "header"},
                          {"required", is_needed},
                          {"schema", {{"type", "string"}}}});
  }
  return parameters;
}

// Successes beside the one that the description names.
void AddOtherAnswers(const CityRoute& route, const Description& description, Json* answers) {
  if (HasRanges(route, description)) {
    (*answers)["206"] = {{"description", "The bytes that Range asks for"},
                         {"content", (*answers)["200"]["content"]}};
  }
  if (HasTag(route)) (*answers)["304"] = {{"description", "It is as If-None-Match has it"}};
  if (!AddsPhoto(route)) return;
  const Json content = (*answers)["201"]["content"];
  (*answers)["200"] = {{"description", "It has taken the place of a smaller copy (`replaced`)"},
                       {"content", content}};
  (*answers)["202"] = {
      {"description",
       "It is on the disk and waits for its turn; Location tells what becomes of it"},
      {"content", content}};
}

Json AnswersOf(const CityRoute& route, const Description& description) {
  const std::string media_type = description.media_type;
  Json answers, content;
  if (media_type.empty()) {
    answers[std::to_string(description.code)] = {{"description", "Done"}};
    answers["default"] = {{"$ref", "#/components/responses/Problem"}};
    return answers;
  }
  if (media_type.ends_with("json")) {
    content[media_type] = {{"schema", Json::object()}};
  } else if (media_type.starts_with("text/")) {
    content[media_type] = {{"schema", {{"type", "string"}}}};
  } else {
    content[media_type] = BinarySchema();
  }
  answers[std::to_string(description.code)] = {{"description", "Done"},
                                               {"content", std::move(content)}};
  AddOtherAnswers(route, description, &answers);
  answers["default"] = {{"$ref", "#/components/responses/Problem"}};
  return answers;
}

Json OperationOf(const CityRoute& route) {
  const Description description = DescriptionOf(route);
  std::string id = route.method;
  std::ranges::transform(id, id.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const std::string& part : route.path) {
    if (part != "v1") id += "_" + (part == "*" ? std::string("one") : part);
  }
  if (route.path.empty()) id += "_page";
  std::ranges::replace(id, '.', '_');
  Json operation = {{"operationId", id}, {"summary", description.summary}};
  if (route.is_for_owner_alone) {
    operation["description"] = "By the socket in the folder of the database alone.";
  } else if (!route.is_for_all)
    operation["description"] = "Takes the role of " + RoleWord(route.role) + " or a higher one.";
  operation["security"] = Json::array();
  if (!route.is_for_all) operation["security"].push_back({{"token", Json::array()}});
  if (Json parameters = ParametersOf(route, description); !parameters.empty())
    operation["parameters"] = std::move(parameters);
  if (description.body != Body::kNone)
    operation["requestBody"] =
        BodyOf(description.body, description.path == std::string("/v1/photos"));
  operation["responses"] = AnswersOf(route, description);
  return operation;
}

Json Components() {
  const Json problem = {
      {"type", "object"},
      {"required", {"title", "status", "detail"}},
      {"properties",
       {{"title", {{"type", "string"}}},
        {"status", {{"type", "integer"}}},
        {"detail", {{"type", "string"}, {"description", "what is wrong and what to do"}}}}}};
  Json content;
  content["application/problem+json"] = {{"schema", {{"$ref", "#/components/schemas/Problem"}}}};
  return {
      {"schemas", {{"Problem", problem}}},
      {"responses",
       {{"Problem", {{"description", "A failure (RFC 9457)"}, {"content", std::move(content)}}}}},
      {"securitySchemes",
       {{"token",
         {{"type", "http"},
          {"scheme", "bearer"},
          {"description", "Needed once the first token was made"}}}}}};
}

}  // namespace

std::string PathTemplate(const CityRoute& route) {
  std::string path, before;
  for (const std::string& part : route.path) {
    const bool is_open = part == "*";
    path += "/" + (is_open ? "{" + ParameterName(before) + "}" : part);
    before = part;
  }
  return path.empty() ? "/" : path;
}

Json OpenApi(std::span<const CityRoute> routes) {
  Json paths;
  for (const CityRoute& route : routes) {
    std::string method = route.method;
    std::ranges::transform(method, method.begin(), [](unsigned char c) { return std::tolower(c); });
    paths[PathTemplate(route)][method] = OperationOf(route);
  }
  return {{"openapi", "3.0.3"},
          {"info",
           {{"title", "Veduta"},
            {"description", "A database of a city's photographs."},
            {"version", "1"},
            {"license",
             {{"name", "Apache-2.0"}, {"url", "https://www.apache.org/licenses/LICENSE-2.0"}}}}},
          {"servers", {{{"url", "/"}}}},
          {"paths", std::move(paths)},
          {"components", Components()}};
}

}  // namespace veduta
