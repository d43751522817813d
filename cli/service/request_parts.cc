// SPDX-License-Identifier: Apache-2.0
#include "cli/service/request_parts.h"

#include <algorithm>

#include "cli/service/path_numbers.h"

namespace veduta {
namespace {

// Arrays and objects that may be in each other. Chosen by hand: no route reads more than three.
constexpr int kDepthMax = 16;

std::string TooLarge(size_t bytes_max) {
  return "the body has more than " + std::to_string(bytes_max) + " bytes";
}

}  // namespace

std::optional<HttpAnswer> RefuseLargeJson(const HttpRequest& request, size_t bytes_max) {
  if (request.body.size() <= bytes_max) return std::nullopt;
  return Problem(413, TooLarge(bytes_max));
}

Result<Json> ShallowJson(std::string_view text, const std::string& what) {
  bool is_deep = false;
  // What is deeper is read and not kept.
  const auto is_kept = [&is_deep](int depth, Json::parse_event_t event, Json&) {
    using Event = Json::parse_event_t;
    if (event == Event::object_start || event == Event::array_start) is_deep |= depth >= kDepthMax;
    return !is_deep;
  };
  Json json = Json::parse(text, is_kept, /*allow_exceptions=*/false);
  if (is_deep)
    return Status::InvalidArgument(what + " has more than " + std::to_string(kDepthMax) +
                                   " arrays and objects in each other");
  return json;
}

Result<Json> JsonObjectOf(const HttpRequest& request, size_t bytes_max) {
  if (request.body.size() > bytes_max) return Status::InvalidArgument(TooLarge(bytes_max));
  const std::string_view text(reinterpret_cast<const char*>(request.body.data()),
                              request.body.size());
  VEDUTA_ASSIGN_OR_RETURN(Json json, ShallowJson(text, "the body"));
  if (!json.is_object()) return Status::InvalidArgument("the body is no JSON object");
  return json;
}

Result<uint64_t> NumberParameter(const HttpRequest& request, const std::string& name,
                                 uint64_t otherwise, uint64_t min, uint64_t max) {
  const auto found = request.query.find(name);
  if (found == request.query.end()) return otherwise;
  return WholeNumber("the parameter '" + name + "'", found->second, min, max);
}

Status RefuseOthers(const Json& object, std::initializer_list<std::string_view> known) {
  for (const auto& [name, value] : object.items()) {
    if (std::ranges::find(known, name) == known.end())
      return Status::InvalidArgument("there is no member '" + name + "' here");
  }
  return Status::Ok();
}

Result<std::string> TextMember(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found != object.end() && found->is_string()) return found->get<std::string>();
  return Status::InvalidArgument("'" + std::string(name) + "' is missing, or is no text");
}

Result<std::string> OptionalText(const Json& object, const char* name) {
  return object.contains(name) ? TextMember(object, name) : std::string();
}

Result<std::string> ActorOf(const Json& object, const HttpRequest& request) {
  if (!request.who.empty()) return request.who;
  return TextMember(object, "actor");
}

Result<uint64_t> OptionalNumber(const Json& object, const char* name, uint64_t max) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return uint64_t{0};
  const std::string what = "'" + std::string(name) + "'";
  if (!found->is_number_unsigned()) return Status::InvalidArgument(what + " is no whole number");
  return WholeNumber(what, found->dump(), 1, max);
}

}  // namespace veduta
