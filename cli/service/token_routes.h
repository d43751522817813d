// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tokens, which administrators make and revoke.

#include <vector>

#include "cli/service/city_route.h"

namespace veduta {

std::vector<CityRoute> TokenRoutes();

}  // namespace veduta
