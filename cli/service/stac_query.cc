// SPDX-License-Identifier: Apache-2.0
#include "cli/service/stac_query.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include "cli/service/path_numbers.h"
#include "cli/service/request_parts.h"
#include "cli/service/stac_geometry.h"
#include "cli/wire/iso_time.h"
#include "cli/wire/stac_json.h"

namespace veduta {
namespace {

constexpr size_t kIdsMax = 1000;            // chosen by hand
constexpr size_t kBodyBytesMax = 64 << 10;  // a border of some thousand positions; chosen by hand

Status Wrong(const std::string& what) {
  return Status::InvalidArgument(what);
}

// "a,b" as ["a", "b"].
Json PartsOf(std::string_view text) {
  Json parts = Json::array();
  while (!text.empty()) {
    const size_t comma = std::min(text.find(','), text.size());
    parts.push_back(std::string(text.substr(0, comma)));
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return parts;
}

Result<Json> MemberOf(const std::string& name, const std::string& text) {
  if (name == "ids" || name == "collections") return PartsOf(text);
  if (name == "datetime" || name == "token") return Json(text);
  // Numbers and an object are written in an address as JSON has them.
  const std::string json = name == "bbox" ? "[" + text + "]" : text;
  if (json.size() > kBodyBytesMax) return Wrong("'" + name + "' is too long");
  VEDUTA_ASSIGN_OR_RETURN(Json value, ShallowJson(json, "'" + name + "'"));
  if (value.is_discarded()) return Wrong("'" + name + "' cannot be read");
  return value;
}

Result<std::vector<std::string>> TextsOf(const Json& value, const char* name) {
  std::vector<std::string> texts;
  if (!value.is_array() || value.size() > kIdsMax)
    return Wrong("'" + std::string(name) + "' must be an array of at most " +
                 std::to_string(kIdsMax) + " texts");
  for (const Json& one : value) {
    if (!one.is_string()) return Wrong("'" + std::string(name) + "' has what is no text");
    texts.push_back(one.get<std::string>());
  }
  return texts;
}

void WantNone(PhotoSearch* search) {
  search->images = {ImageId(std::numeric_limits<uint32_t>::max())};
}

Status TakeLimit(const Json& value, PhotoSearch* search) {
  const bool is_right = value.is_number_integer() && value >= 1;
  if (!is_right) return Wrong("'limit' must be a whole number from 1");
  search->count_max =
      static_cast<uint32_t>(std::min<uint64_t>(value.get<uint64_t>(), kStacItemsMax));
  return Status::Ok();
}

Status TakeIds(const Json& value, PhotoSearch* search) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> ids, TextsOf(value, "ids"));
  if (ids.empty()) return Status::Ok();
  WantNone(search);
  for (const std::string& id : ids) {
    const auto number = WholeNumber("id", id, 1, std::numeric_limits<uint32_t>::max());
    // What is no number is no item's id.
    if (number.ok()) search->images.emplace_back(static_cast<uint32_t>(*number));
  }
  return Status::Ok();
}

Status TakeCollections(const Json& value, PhotoSearch* search) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> names, TextsOf(value, "collections"));
  if (!names.empty() && std::ranges::find(names, kStacCollection) == names.end()) WantNone(search);
  return Status::Ok();
}

Status TakeDatetime(const Json& value, PhotoSearch* search) {
  if (!value.is_string()) return Wrong("'datetime' is no text");
  VEDUTA_ASSIGN_OR_RETURN(const TimeInterval interval, ParseInterval(value.get<std::string>()));
  search->taken_from_unix_s = interval.from_unix_s;
  search->taken_to_unix_s = interval.to_unix_s;
  return Status::Ok();
}

Status TakeToken(const Json& value, PhotoSearch* search) {
  if (!value.is_string()) return Wrong("'token' is no text");
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t after,
                          WholeNumber("'token'", value.get<std::string>(), 0,
                                      std::numeric_limits<uint32_t>::max() - 1));
  search->after = ImageId(static_cast<uint32_t>(after));
  return Status::Ok();
}

Status TakePart(const Json& value, bool is_box, PhotoSearch* search) {
  if (search->is_there) return Wrong("'bbox' and 'intersects' may not both be given");
  VEDUTA_ASSIGN_OR_RETURN(search->is_there, is_box ? BoxOf(value) : GeometryOf(value));
  return Status::Ok();
}

// As a part of a query.
std::string Escaped(const std::string& text) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string escaped;
  for (const unsigned char c : text) {
    if (std::isalnum(c) != 0 || c == '-' || c == '.' || c == '_' || c == '~' || c == ',') {
      escaped += static_cast<char>(c);
    } else {
      escaped += {'%', kDigits[c >> 4], kDigits[c & 15]};
    }
  }
  return escaped;
}

}  // namespace

Result<Json> StacMembers(const HttpRequest& request) {
  if (request.method == "POST") return JsonObjectOf(request, kBodyBytesMax);
  Json members = Json::object();
  for (const auto& [name, text] : request.query) {
    VEDUTA_ASSIGN_OR_RETURN(members[name], MemberOf(name, text));
  }
  return members;
}

Result<PhotoSearch> ParseStacQuery(const Json& members) {
  PhotoSearch search;
  search.count_max = kStacItemsDefault;
  for (const auto& [name, value] : members.items()) {
    if (value.is_null()) continue;
    if (name == "limit") {
      VEDUTA_RETURN_IF_ERROR(TakeLimit(value, &search));
    } else if (name == "bbox" || name == "intersects") {
      VEDUTA_RETURN_IF_ERROR(TakePart(value, name == "bbox", &search));
    } else if (name == "datetime") {
      VEDUTA_RETURN_IF_ERROR(TakeDatetime(value, &search));
    } else if (name == "ids") {
      VEDUTA_RETURN_IF_ERROR(TakeIds(value, &search));
    } else if (name == "token") {
      VEDUTA_RETURN_IF_ERROR(TakeToken(value, &search));
    } else if (name != "collections") {
      return Wrong("a search has no member '" + name + "'");
    }
  }
  // Last: none of the photos that were named is in another collection.
  const Json collections = members.value("collections", Json());
  if (!collections.is_null()) VEDUTA_RETURN_IF_ERROR(TakeCollections(collections, &search));
  return search;
}

Json NextStacLink(const HttpRequest& request, const Json& members, const std::string& href,
                  ImageId after) {
  const std::string token = std::to_string(after.value);
  if (request.method == "POST") {
    Json link = StacLink("next", kGeoJson, href);
    link["method"] = "POST";
    link["body"] = members;
    link["body"]["token"] = token;
    return link;
  }
  std::string query = "?token=" + token;
  for (const auto& [name, text] : request.query) {
    if (name != "token") query += "&" + name + "=" + Escaped(text);
  }
  Json link = StacLink("next", kGeoJson, href + query);
  link["method"] = "GET";
  return link;
}

}  // namespace veduta
