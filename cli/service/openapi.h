// SPDX-License-Identifier: Apache-2.0
#pragma once
// The daemon's routes as a document that programs read: OpenAPI 3.0.

#include <span>
#include <string>

#include "cli/service/city_route.h"
#include "cli/wire/json.h"

namespace veduta {

// "/v1/photos/{photo}/pose": the parts of a path that stand for anything are called by what is
// before them.
std::string PathTemplate(const CityRoute& route);

// All routes, with what they take, whom they answer and what a failure looks like. The objects in
// their answers are those of docs/json.md, and are not described anew. A route that nothing is said
// of has an empty summary.
Json OpenApi(std::span<const CityRoute> routes);

}  // namespace veduta
