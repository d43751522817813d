// SPDX-License-Identifier: Apache-2.0
#pragma once
// Links that let whoever has them read: tokens of viewers which expire, and which curators make.

#include <vector>

#include "cli/service/city_route.h"

namespace veduta {

std::vector<CityRoute> LinkRoutes();

}  // namespace veduta
