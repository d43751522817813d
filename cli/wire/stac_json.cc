// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/stac_json.h"

#include <algorithm>
#include <cctype>

#include "cli/wire/iso_time.h"
#include "engine/door/answers.h"

namespace veduta {
namespace {

constexpr const char* kVersion = "1.0.0";
constexpr const char* kJson = "application/json";

std::string PathOfCollection(const std::string& base) {
  return base + kStacPath + "/collections/" + kStacCollection;
}

// A photo is found by "#" and its number, also where its name means several.
std::string PathOfPhoto(const FoundPhoto& photo, const std::string& base) {
  return base + "/v1/photos/%23" + std::to_string(photo.id.value);
}

// The first letter of STAC's own pattern for a licence; identifiers of SPDX have that form.
bool IsLicenceIdentifier(const std::string& licence) {
  return !licence.empty() && std::ranges::all_of(licence, [](unsigned char c) {
    return c < 0x80 && (std::isalnum(c) != 0 || c == '.' || c == '-' || c == '+' || c == '_');
  });
}

bool IsWebAddress(const std::string& text) {
  return (text.starts_with("https://") || text.starts_with("http://")) &&
         text.find(' ') == text.npos;
}

Json Numbers(std::initializer_list<double> numbers) {
  return Json(std::vector<double>(numbers));
}

void AddPlace(const FoundPhoto& photo, Json* item) {
  Json& properties = (*item)["properties"];
  (*item)["geometry"] = nullptr;
  if (!photo.on_earth && !photo.gps) return;
  const double longitude =
      photo.on_earth ? photo.on_earth->position.longitude_deg : photo.gps->longitude_deg;
  const double latitude =
      photo.on_earth ? photo.on_earth->position.latitude_deg : photo.gps->latitude_deg;
  (*item)["geometry"] = {{"type", "Point"}, {"coordinates", Numbers({longitude, latitude})}};
  (*item)["bbox"] = Numbers({longitude, latitude, longitude, latitude});
  properties["veduta:position"] = photo.on_earth ? "pose" : "gps";
  const double accuracy_m =
      photo.on_earth ? photo.on_earth->horizontal_stddev_m : photo.gps->accuracy_m;
  if (accuracy_m > 0) properties["veduta:horizontal_stddev_m"] = accuracy_m;
  if (!photo.on_earth) return;
  properties["view:azimuth"] = photo.on_earth->heading_deg;
  // A camera that looks above the horizon has no angle off nadir that STAC would take.
  if (photo.on_earth->pitch_deg <= 0) properties["view:off_nadir"] = 90 + photo.on_earth->pitch_deg;
}

void AddTime(const FoundPhoto& photo, Json* properties) {
  const bool is_exact = photo.taken_from_unix_s == photo.taken_to_unix_s;
  (*properties)["datetime"] = is_exact ? Json(IsoTime(photo.taken_from_unix_s)) : Json(nullptr);
  if (!is_exact) {
    (*properties)["start_datetime"] = IsoTime(photo.taken_from_unix_s);
    (*properties)["end_datetime"] = IsoTime(photo.taken_to_unix_s);
  }
  if (!photo.taken) return;
  std::string clock = IsoTime(photo.taken->local_unix_s);
  clock.pop_back();  // the Z: it is of no zone
  (*properties)["veduta:camera_clock"] = clock;
}

Json AssetsOf(const FoundPhoto& photo, const std::string& base) {
  const std::string path = PathOfPhoto(photo, base);
  Json original = {{"href", path + "/file"},
                   {"title", "The photo as it came; for curators, where there are tokens"}};
  if (!photo.media_type.empty()) original["type"] = photo.media_type;
  original["roles"] = {"data"};
  original["file:size"] = photo.size_bytes;
  original["file:checksum"] = "1220" + photo.sha256;  // a multihash of SHA-256
  original["proj:shape"] = {photo.height_px, photo.width_px};
  return {{"thumbnail",
           {{"href", path + "/thumbnail?side=256"},
            {"title", "A small picture"},
            {"type", "image/jpeg"},
            {"roles", {"thumbnail"}}}},
          {"overview",
           {{"href", path + "/thumbnail?side=2048"},
            {"title", "The photo, upright"},
            {"type", "image/jpeg"},
            {"roles", {"overview", "visual"}}}},
          {"photo", std::move(original)}};
}

Json LinksOf(const FoundPhoto& photo, const std::string& base) {
  const std::string path = PathOfPhoto(photo, base), collection = PathOfCollection(base);
  Json links = {StacLink("self", kGeoJson, collection + "/items/" + std::to_string(photo.id.value)),
                StacLink("root", kJson, base + kStacPath),
                StacLink("parent", kJson, collection),
                StacLink("collection", kJson, collection),
                StacLink("about", kJson, path),
                StacLink("neighbors", kJson, path + "/neighbors")};
  if (photo.reconstruction.valid()) links.push_back(StacLink("pose", kJson, path + "/pose"));
  if (photo.on_earth) links.push_back(StacLink("geopose", kJson, path + "/geopose"));
  if (photo.contribution != 0)
    links.push_back(StacLink("contribution", kJson,
                             base + "/v1/contributions/" + std::to_string(photo.contribution)));
  if (IsWebAddress(photo.licence)) links.push_back({{"rel", "license"}, {"href", photo.licence}});
  return links;
}

}  // namespace

Json StacLink(const char* rel, const char* type, const std::string& href) {
  return {{"rel", rel}, {"type", type}, {"href", href}};
}

Json StacItem(const FoundPhoto& photo, const std::string& base) {
  Json item = {{"type", "Feature"}, {"stac_version", kVersion}};
  item["stac_extensions"] = {"https://stac-extensions.github.io/file/v2.1.0/schema.json",
                             "https://stac-extensions.github.io/projection/v2.0.0/schema.json",
                             "https://stac-extensions.github.io/view/v1.0.0/schema.json"};
  item["id"] = std::to_string(photo.id.value);
  item["collection"] = kStacCollection;
  Json& properties = item["properties"] = Json::object();
  AddTime(photo, &properties);
  properties["title"] = photo.name;
  properties["created"] = IsoTime(photo.stored_unix_s);
  if (IsLicenceIdentifier(photo.licence)) {
    properties["license"] = photo.licence;
  } else if (IsWebAddress(photo.licence)) {
    properties["license"] = "proprietary";  // STAC's word for what a link tells
  }
  if (!photo.licence.empty()) properties["veduta:licence"] = photo.licence;
  properties["veduta:contributor"] = photo.contributor;
  properties["veduta:verdict"] = VerdictWord(photo.verdict);
  if (photo.is_hidden) properties["veduta:hidden"] = true;
  if (photo.reconstruction.valid())
    properties["veduta:reconstruction"] = photo.reconstruction.value;
  properties["proj:code"] = nullptr;  // a photo is in no plane of the earth
  AddPlace(photo, &item);
  item["assets"] = AssetsOf(photo, base);
  item["links"] = LinksOf(photo, base);
  return item;
}

Json StacCollection(const PhotoExtent& extent, const std::string& base) {
  const auto time = [](const std::optional<int64_t>& unix_s) {
    return unix_s ? Json(IsoTime(*unix_s)) : Json(nullptr);
  };
  Json bbox = {-180, -90, 180, 90};
  if (extent.south_west && extent.north_east) {
    const GeoPosition &low = *extent.south_west, &high = *extent.north_east;
    bbox = Numbers({low.longitude_deg, low.latitude_deg, high.longitude_deg, high.latitude_deg});
  }
  Json interval = {time(extent.taken_from_unix_s), time(extent.taken_to_unix_s)};
  // One end at least is to be told: there are no photographs from before.
  if (!extent.taken_from_unix_s) interval[0] = IsoTime(kTakenUnixSMin);
  const std::string path = PathOfCollection(base);
  return {{"type", "Collection"},
          {"stac_version", kVersion},
          {"stac_extensions", Json::array()},
          {"id", kStacCollection},
          {"title", "Photos"},
          {"description", "The photos of the city, each by when and where it was taken."},
          {"license", "various"},
          {"extent",
           {{"spatial", {{"bbox", Json::array({bbox})}}},
            {"temporal", {{"interval", Json::array({interval})}}}}},
          {"links",
           {StacLink("self", kJson, path), StacLink("root", kJson, base + kStacPath),
            StacLink("parent", kJson, base + kStacPath),
            StacLink("items", kGeoJson, path + "/items")}}};
}

Json StacLandingPage(const std::string& base) {
  const std::string root = base + kStacPath;
  const auto search = [&](const char* method) {
    Json link = StacLink("search", kGeoJson, root + "/search");
    link["method"] = method;
    return link;
  };
  return {{"type", "Catalog"},
          {"stac_version", kVersion},
          {"stac_extensions", Json::array()},
          {"id", "veduta"},
          {"title", "Veduta"},
          {"description", "A database of a city's photographs."},
          {"conformsTo", StacConformance()["conformsTo"]},
          {"links",
           {StacLink("self", kJson, root), StacLink("root", kJson, root),
            StacLink("service-desc", kJson, base + "/v1/openapi.json"),
            StacLink("conformance", kJson, root + "/conformance"),
            StacLink("data", kJson, root + "/collections"),
            StacLink("child", kJson, PathOfCollection(base)), search("GET"), search("POST")}}};
}

Json StacConformance() {
  return {{"conformsTo",
           {"https://api.stacspec.org/v1.0.0/core", "https://api.stacspec.org/v1.0.0/collections",
            "https://api.stacspec.org/v1.0.0/ogcapi-features",
            "https://api.stacspec.org/v1.0.0/item-search",
            "http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/core",
            "http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/oas30",
            "http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/geojson"}}};
}

}  // namespace veduta
