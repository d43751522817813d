// SPDX-License-Identifier: Apache-2.0
#pragma once
// What can be asked of the daemon about contributions, and about photos that arrive in parts.

#include <vector>

#include "cli/service/city_route.h"

namespace veduta {

// Contributions are closed by their contributor, or by who may send photos under any name, and are
// removed with their photos, as Engine::Remove does. TusUploads answers the routes of uploads.
std::vector<CityRoute> ContributionRoutes();

// Whether the request is to open a contribution. Thread-safe.
bool OpensContribution(const HttpRequest& request);

}  // namespace veduta
