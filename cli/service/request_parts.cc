// SPDX-License-Identifier: Apache-2.0
#include "cli/service/request_parts.h"

#include "cli/service/path_numbers.h"

namespace veduta {

Result<uint64_t> NumberParameter(const HttpRequest& request, const std::string& name,
                                 uint64_t otherwise, uint64_t min, uint64_t max) {
  const auto found = request.query.find(name);
  if (found == request.query.end()) return otherwise;
  return WholeNumber("the parameter '" + name + "'", found->second, min, max);
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
