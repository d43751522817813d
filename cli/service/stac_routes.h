// SPDX-License-Identifier: Apache-2.0
#pragma once
// The photos as a STAC API 1.0.0, below /v1/stac.

#include <vector>

#include "cli/service/city_route.h"

namespace veduta {

std::vector<CityRoute> StacRoutes();

}  // namespace veduta
