// SPDX-License-Identifier: Apache-2.0
#include "cli/service/surface_answers.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/service/path_numbers.h"

namespace veduta {
namespace {

constexpr std::string_view kEnding = ".glb";

std::string Quoted(const std::string& tag) {
  return "\"" + tag + "\"";
}

}  // namespace

HttpAnswer AnswerWithTileset(Engine* engine, const HttpRequest& request,
                             const PathArguments& arguments) {
  const Result<ReconstructionId> id = ReconstructionNumber(arguments[0]);
  if (!id.ok()) return ProblemOf(id.status());
  Result<TilesetAnswer> tileset = engine->Ask(request.sight).Tileset(*id);
  if (!tileset.ok()) return ProblemOf(tileset.status());
  HttpAnswer answer;
  answer.headers = {{"ETag", Quoted(tileset->tag)}};
  if (request.if_none_match == Quoted(tileset->tag)) {
    answer.code = 304;
  } else {
    answer.body = std::move(tileset->json);
  }
  return answer;
}

HttpAnswer AnswerWithSurfaceTile(Engine* engine, const HttpRequest& request,
                                 const PathArguments& arguments) {
  const Result<ReconstructionId> id = ReconstructionNumber(arguments[0]);
  if (!id.ok()) return ProblemOf(id.status());
  const std::string& file = arguments[1];
  if (!file.ends_with(kEnding))
    return Problem(404, "a tile of a surface is called NAME.glb, as tileset.json has it");
  const std::string name = file.substr(0, file.size() - kEnding.size());
  HttpAnswer answer;
  answer.content_type = "model/gltf-binary";
  // A browser keeps it for those alone who ask with the same token.
  answer.headers = {{"ETag", Quoted(name)},
                    {"Cache-Control", "private, max-age=31536000, immutable"},
                    {"Vary", "Authorization"}};
  // The name stands for the bytes, which whoever has them has right.
  if (request.if_none_match == Quoted(name)) {
    answer.code = 304;
    return answer;
  }
  Result<SurfaceTileAnswer> tile = engine->Ask(request.sight).SurfaceTile(*id, name);
  if (!tile.ok()) return ProblemOf(tile.status());
  answer.body.assign(tile->glb.begin(), tile->glb.end());
  // These are not the bytes that the name stands for, and nobody may keep them.
  if (!tile->left_out.empty()) answer.headers = {{"Cache-Control", "no-store"}};
  answer.damages = std::move(tile->left_out);
  return answer;
}

}  // namespace veduta
