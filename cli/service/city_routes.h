// SPDX-License-Identifier: Apache-2.0
#pragma once
// What can be asked of the daemon, and how the engine is asked for it. Answers have the shapes of
// docs/json.md; docs/serving.md lists the routes.

#include <span>
#include <string>
#include <variant>
#include <vector>

#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

using PathArguments = std::vector<std::string>;

struct CityRoute {
  const char* method;
  std::vector<std::string> path;        // "*" stands for any one part
  std::vector<std::string> parameters;  // that the query may have
  // Answers the request; `arguments` are the parts of the path that stand for "*". Takes as long as
  // the function of the engine that it calls. Null: the daemon itself knows what to do.
  HttpAnswer (*answer)(Engine* engine, const HttpRequest& request, const PathArguments& arguments);
  bool is_of_snapshot = false;  // the same snapshot gives the same answer
  // It reads a few records, and so is answered on the thread that the connection is on.
  bool is_quick = false;
  // Who may ask, where there are tokens.
  Role role = Role::kViewer;
  bool is_for_owner = false;  // where there are none, it is answered to the owner alone
  bool is_for_all = false;    // it needs no token
};

struct RouteMatch {
  const CityRoute* route = nullptr;
  PathArguments arguments;
};

// All there are.
std::span<const CityRoute> ListRoutes();

// The number of an upload, from a part of a path.
Result<uint64_t> UploadNumber(const std::string& text);

// The route of a request; otherwise the answer to it: 404 where nothing is there, 405 where another
// method would be right, 400 for a parameter that is not known. Thread-safe.
std::variant<RouteMatch, HttpAnswer> FindRoute(const HttpRequest& request);

}  // namespace veduta
