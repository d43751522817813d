// SPDX-License-Identifier: Apache-2.0
#pragma once
// The web page, as the daemon hands it out.

#include "cli/service/city_route.h"

namespace veduta {

// The file of the page that the path names; `/` is index.html. The page asks nobody but the
// daemon, runs no script but its own, and lies in no frame of another page: browsers are told so.
HttpAnswer AnswerWithPage(Engine* engine, const HttpRequest& request,
                          const PathArguments& arguments);

}  // namespace veduta
