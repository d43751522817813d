// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which of two media types of an answer a client would rather have.

#include <string>
#include <string_view>

namespace veduta {

// OGC GeoPose 1.0, as IANA has registered it.
inline constexpr const char* kGeoPoseType = "application/geopose+json";

// How much the header `Accept` (RFC 9110, 12.5.1) wants the type, 0 to 1: what the most specific
// range that fits says; 1 for all where there is no header. A range with a parameter `version`
// other than 1.0 fits nothing. What is malformed is passed over. O(size).
double QualityOf(std::string_view accept, std::string_view type);

// Whether the header wants a GeoPose more than plain JSON.
bool PrefersGeoPose(std::string_view accept);

}  // namespace veduta
