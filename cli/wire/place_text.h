// SPDX-License-Identifier: Apache-2.0
#pragma once
// A place on the earth as people write it.

#include <optional>
#include <string_view>

#include "engine/door/earth.h"

namespace veduta {

// "47.07,15.44": latitude and longitude in degrees. Nothing where it is something else.
std::optional<GeoPosition> ParsePlace(std::string_view text);

}  // namespace veduta
