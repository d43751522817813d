// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers and texts in what a request carries. Failures are kInvalidArgument and name the part.

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "cli/service/http_message.h"
#include "storage/base/status.h"

namespace veduta {

// A parameter of the query; `otherwise` where it is not given.
Result<uint64_t> NumberParameter(const HttpRequest& request, const std::string& name,
                                 uint64_t otherwise, uint64_t min, uint64_t max);

// Of a body in JSON, where its route says nothing else. Parsed JSON takes many times its text.
// Chosen by hand.
inline constexpr size_t kJsonBytesMax = 256 << 10;

// The answer to a body of more bytes, 413.
std::optional<HttpAnswer> RefuseLargeJson(const HttpRequest& request,
                                          size_t bytes_max = kJsonBytesMax);
// A text of JSON with arrays and objects in each other up to a fixed depth; `what` names it where
// it is deeper. Discarded (Json::is_discarded) where it is no JSON.
Result<Json> ShallowJson(std::string_view text, const std::string& what);
// The body, which must be a JSON object of at most so many bytes, no deeper than that.
Result<Json> JsonObjectOf(const HttpRequest& request, size_t bytes_max = kJsonBytesMax);

// Refuses an object with a member that nobody reads.
Status RefuseOthers(const Json& object, std::initializer_list<std::string_view> known);

// The member of a JSON object that must be a text.
Result<std::string> TextMember(const Json& object, const char* name);
// The member of a JSON object, "" where there is none.
Result<std::string> OptionalText(const Json& object, const char* name);
// The member of a JSON object that must be a whole number from 1 to `max`; 0 where there is none.
Result<uint64_t> OptionalNumber(const Json& object, const char* name, uint64_t max);

// Who asks, for the journal: whose token it is, or whom the owner names.
Result<std::string> ActorOf(const Json& object, const HttpRequest& request);

}  // namespace veduta
