// SPDX-License-Identifier: Apache-2.0
#pragma once
// What curators hide, what people report, and who is who.

#include <vector>

#include "cli/service/city_route.h"

namespace veduta {

std::vector<CityRoute> ModerationRoutes();

// Whether this is a report of a photo, of which each token has its own quota.
bool IsReport(const HttpRequest& request);

}  // namespace veduta
