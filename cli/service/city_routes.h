// SPDX-License-Identifier: Apache-2.0
#pragma once
// What can be asked of the daemon, and how the engine is asked for it. Answers have the shapes of
// docs/json.md; docs/serving.md lists the routes.

#include <span>
#include <string>
#include <variant>

#include "cli/service/city_route.h"
#include "cli/service/http_message.h"

namespace veduta {

struct RouteMatch {
  const CityRoute* route = nullptr;
  PathArguments arguments;
};

// All there are.
std::span<const CityRoute> ListRoutes();

// The route of a request; otherwise the answer to it: 404 where nothing is there, 405 where another
// method would be right, 400 for a parameter that is not known. Thread-safe.
std::variant<RouteMatch, HttpAnswer> FindRoute(const HttpRequest& request);

}  // namespace veduta
