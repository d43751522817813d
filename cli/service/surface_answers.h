// SPDX-License-Identifier: Apache-2.0
#pragma once
// The dense surface as 3D Tiles over HTTP.

#include "cli/service/city_route.h"

namespace veduta {

// The argument is the reconstruction's number. The answer has a tag of its own, which changes with
// the surface and not with each commit.
HttpAnswer AnswerWithTileset(Engine* engine, const HttpRequest& request,
                             const PathArguments& arguments);
// The arguments are the reconstruction's number and "NAME.glb". Such an answer never changes, and
// whoever has it need not ask again.
HttpAnswer AnswerWithSurfaceTile(Engine* engine, const HttpRequest& request,
                                 const PathArguments& arguments);

}  // namespace veduta
