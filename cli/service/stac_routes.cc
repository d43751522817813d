// SPDX-License-Identifier: Apache-2.0
#include "cli/service/stac_routes.h"

#include <algorithm>

#include "cli/service/stac_query.h"
#include "cli/wire/stac_json.h"

namespace veduta {
namespace {

// What the paths of links are put behind: the address that the client has asked, by its `Host`. A
// proxy with TLS before the daemon says so.
std::string BaseOf(const HttpRequest& request) {
  const std::string host = HeaderOf(request, "Host");
  const bool is_name =
      !host.empty() && host.size() <= 255 && std::ranges::all_of(host, [](unsigned char c) {
        return c < 0x80 && (std::isalnum(c) != 0 || c == '.' || c == '-' || c == ':' || c == '[' ||
                            c == ']' || c == '_');
      });
  if (!is_name) return "";
  return (HeaderOf(request, "X-Forwarded-Proto") == "https" ? "https://" : "http://") + host;
}

HttpAnswer GeoJsonAnswer(const Json& json) {
  HttpAnswer answer = JsonAnswer(200, json);
  answer.content_type = kGeoJson;
  return answer;
}

std::optional<HttpAnswer> RefuseCollection(const std::string& name) {
  if (name == kStacCollection) return std::nullopt;
  return Problem(404, "there is no collection '" + name + "', only '" + kStacCollection + "'");
}

HttpAnswer GetLandingPage(Engine*, const HttpRequest& request, const PathArguments&) {
  return JsonAnswer(200, StacLandingPage(BaseOf(request)));
}

HttpAnswer GetConformance(Engine*, const HttpRequest&, const PathArguments&) {
  return JsonAnswer(200, StacConformance());
}

Result<Json> CollectionOf(const Engine& engine, const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const PhotoExtent extent, engine.Ask(request.sight).Extent());
  return StacCollection(extent, BaseOf(request));
}

HttpAnswer ListCollections(Engine* engine, const HttpRequest& request, const PathArguments&) {
  Result<Json> collection = CollectionOf(*engine, request);
  if (!collection.ok()) return ProblemOf(collection.status());
  const std::string root = BaseOf(request) + kStacPath;
  return JsonAnswer(200, {{"collections", Json::array({*std::move(collection)})},
                          {"links",
                           {StacLink("self", "application/json", root + "/collections"),
                            StacLink("root", "application/json", root)}}});
}

HttpAnswer GetCollection(Engine* engine, const HttpRequest& request,
                         const PathArguments& arguments) {
  if (auto refusal = RefuseCollection(arguments[0])) return *std::move(refusal);
  const Result<Json> collection = CollectionOf(*engine, request);
  return collection.ok() ? JsonAnswer(200, *collection) : ProblemOf(collection.status());
}

Result<Json> FeaturesOf(const Engine& engine, const HttpRequest& request, const std::string& path) {
  VEDUTA_ASSIGN_OR_RETURN(const Json members, StacMembers(request));
  VEDUTA_ASSIGN_OR_RETURN(const PhotoSearch search, ParseStacQuery(members));
  VEDUTA_ASSIGN_OR_RETURN(const FoundPhotos found, engine.Ask(request.sight).SearchPhotos(search));
  const std::string base = BaseOf(request), href = base + path;
  Json features = Json::array();
  for (const FoundPhoto& photo : found.photos) features.push_back(StacItem(photo, base));
  Json links = {StacLink("self", kGeoJson, href),
                StacLink("root", "application/json", base + kStacPath)};
  if (found.next_after.valid())
    links.push_back(NextStacLink(request, members, href, found.next_after));
  const size_t count = features.size();
  return Json{{"type", "FeatureCollection"},
              {"features", std::move(features)},
              {"numberReturned", count},
              {"links", std::move(links)}};
}

HttpAnswer Search(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (request.method == "POST" && request.content_type != "application/json")
    return Problem(415, "the content type is '" + request.content_type +
                            "': a search is sent as application/json");
  const Result<Json> features = FeaturesOf(*engine, request, std::string(kStacPath) + "/search");
  return features.ok() ? GeoJsonAnswer(*features) : ProblemOf(features.status());
}

HttpAnswer ListItems(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  if (auto refusal = RefuseCollection(arguments[0])) return *std::move(refusal);
  const Result<Json> features = FeaturesOf(
      *engine, request, std::string(kStacPath) + "/collections/" + kStacCollection + "/items");
  return features.ok() ? GeoJsonAnswer(*features) : ProblemOf(features.status());
}

HttpAnswer GetItem(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  if (auto refusal = RefuseCollection(arguments[0])) return *std::move(refusal);
  const auto search = ParseStacQuery({{"ids", Json::array({arguments[1]})}});
  if (!search.ok()) return ProblemOf(search.status());
  const auto found = engine->Ask(request.sight).SearchPhotos(*search);
  if (!found.ok()) return ProblemOf(found.status());
  if (found->photos.empty())
    return Problem(404, "there is no item '" + arguments[1] +
                            "': an item's id is the number of a photo that is stored");
  return GeoJsonAnswer(StacItem(found->photos.front(), BaseOf(request)));
}

}  // namespace

std::vector<CityRoute> StacRoutes() {
  const std::vector<std::string> of_items = {"limit", "bbox", "datetime", "token"};
  std::vector<std::string> of_search = of_items;
  of_search.insert(of_search.end(), {"intersects", "ids", "collections"});
  return {
      {"GET", {"v1", "stac"}, {}, GetLandingPage},
      {"GET", {"v1", "stac", "conformance"}, {}, GetConformance},
      {"GET", {"v1", "stac", "collections"}, {}, ListCollections, true},
      {"GET", {"v1", "stac", "collections", "*"}, {}, GetCollection, true},
      {"GET", {"v1", "stac", "collections", "*", "items"}, of_items, ListItems, true},
      {"GET", {"v1", "stac", "collections", "*", "items", "*"}, {}, GetItem, true},
      {"GET", {"v1", "stac", "search"}, of_search, Search, true},
      {"POST", {"v1", "stac", "search"}, {}, Search},
  };
}

}  // namespace veduta
