// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/place_text.h"

#include <charconv>
#include <cmath>

namespace veduta {
namespace {

std::optional<double> DegreesOf(std::string_view text, double degrees_max) {
  double degrees = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), degrees);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return std::abs(degrees) <= degrees_max ? std::optional(degrees) : std::nullopt;
}

}  // namespace

std::optional<GeoPosition> ParsePlace(std::string_view text) {
  const size_t comma = text.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  const auto latitude = DegreesOf(text.substr(0, comma), 90),
             longitude = DegreesOf(text.substr(comma + 1), 180);
  if (!latitude || !longitude) return std::nullopt;
  return GeoPosition{*latitude, *longitude, 0};
}

}  // namespace veduta
