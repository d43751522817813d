// SPDX-License-Identifier: Apache-2.0
#include "cli/service/gatekeeper.h"

#include <algorithm>
#include <iterator>

namespace veduta {
namespace {

HttpAnswer AskForToken(const std::string& why) {
  HttpAnswer answer = Problem(401, why);
  answer.headers.emplace_back("WWW-Authenticate", "Bearer realm=\"veduta\"");
  return answer;
}

// What a link for a part of the city may ask for: what the engine tells photo by photo, or of one
// reconstruction after the other, and so leaves out what is no part of it.
constexpr const char* kOfParts[] = {"me",      "status",        "photos",      "reconstructions",
                                    "stac",    "contributions", "journal",     "events",
                                    "cameras", "hypotheses",    "georeference"};

bool IsOfParts(const CityRoute& route) {
  return route.path.size() > 1 && std::ranges::find(kOfParts, route.path[1]) != std::end(kOfParts);
}

}  // namespace

Status Gatekeeper::Look(const Questions& ask) const {
  const auto tokens = ask.Tokens();
  door_ = !tokens.ok() ? Door::kUnread : tokens->empty() ? Door::kOpen : Door::kByToken;
  return tokens.status();
}

std::optional<HttpAnswer> Gatekeeper::Refuse(const Engine& engine, const CityRoute& route,
                                             HttpRequest* request) const {
  request->sight = {.sees_hidden = request->is_of_owner};
  if (request->is_of_owner || route.is_for_all) return std::nullopt;
  if (door_ == Door::kUnread) {
    if (const Status read = Look(engine.Ask()); !read.ok()) return ProblemOf(read);
  }
  if (!asks_for_tokens()) {
    if (!route.is_for_owner) return std::nullopt;
    return Problem(403,
                   "this is for the owner of the database alone, by the socket in its folder, "
                   "until there are tokens");
  }
  if (request->token.empty())
    return AskForToken("send a token, as the header 'Authorization: Bearer TOKEN'");
  auto token = engine.Ask().CheckToken(request->token);
  // The files were opened again while it was read, as by a removal.
  if (token.status().code() == StatusCode::kBusy) token = engine.Ask().CheckToken(request->token);
  if (!token.ok()) return ProblemOf(token.status());
  if (!*token) return AskForToken("the token is none, has expired, or was revoked");
  if (route.is_for_owner_alone)
    return Problem(403, "this is for the owner of the database alone, by the socket in its folder");
  if ((*token)->role < route.role) {
    return Problem(403, "this takes the role of " + RoleWord(route.role) + ", and the token is a " +
                            RoleWord((*token)->role) + "'s");
  }
  request->who = (*token)->name;
  request->role = (*token)->role;
  request->token_number = (*token)->number;
  request->quota = (*token)->quota;
  request->may_name_others = (*token)->role >= Role::kCurator;
  request->sight.sees_hidden = (*token)->role >= Role::kCurator;
  request->sight.contribution = (*token)->contribution;
  request->sight.reconstruction = ReconstructionId((*token)->reconstruction);
  const bool is_part = (*token)->contribution != 0 || (*token)->reconstruction != 0;
  if (is_part && !IsOfParts(route))
    return Problem(403, "the link shows a part of the city alone, and this is about all of it");
  return RefuseNaming(*request);
}

std::optional<HttpAnswer> Gatekeeper::RefuseNaming(const HttpRequest& request) {
  const auto contributor = request.query.find("contributor");
  if (contributor != request.query.end() && contributor->second != request.who &&
      !request.may_name_others)
    return Problem(403, "photos are sent under the token's name, " + request.who +
                            ": leave the parameter 'contributor' out");
  return std::nullopt;
}

}  // namespace veduta
