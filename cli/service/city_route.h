// SPDX-License-Identifier: Apache-2.0
#pragma once
// One thing that can be asked of the daemon: where, with what, by whom, and who answers it.

#include <string>
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
  // It reads a few records, and so is answered on the thread that the connection is on. Of a photo
  // only where Questions::TellsImagesAtOnce.
  bool is_quick = false;
  // Who may ask, where there are tokens.
  Role role = Role::kViewer;
  bool is_for_owner = false;        // where there are none, it is answered to the owner alone
  bool is_for_all = false;          // it needs no token
  bool is_for_owner_alone = false;  // no token is enough
};

}  // namespace veduta
