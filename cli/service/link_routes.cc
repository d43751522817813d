// SPDX-License-Identifier: Apache-2.0
#include "cli/service/link_routes.h"

#include <algorithm>
#include <ctime>
#include <limits>

#include "cli/service/path_numbers.h"
#include "cli/service/request_parts.h"
#include "cli/wire/token_json.h"

namespace veduta {
namespace {

// So long a link may be good. Chosen by hand: who needs it for longer makes another one.
constexpr int64_t kLinkDaysMax = 366, kDayS = 24 * 60 * 60;

Result<std::vector<TokenAnswer>> LinksOf(const Engine& engine) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<TokenAnswer> tokens, engine.Ask().Tokens());
  std::erase_if(tokens, [](const TokenAnswer& token) { return !token.is_link; });
  return tokens;
}

HttpAnswer ListLinks(Engine* engine, const HttpRequest&, const PathArguments&) {
  const auto links = LinksOf(*engine);
  return links.ok() ? JsonAnswer(200, ToJson(*links)) : ProblemOf(links.status());
}

Result<NewToken> MakeLinkOf(Engine* engine, const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  TokenRequest wanted;
  wanted.is_link = true;
  VEDUTA_ASSIGN_OR_RETURN(wanted.name, TextMember(json, "name"));
  VEDUTA_ASSIGN_OR_RETURN(wanted.actor, ActorOf(json, request));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t days, OptionalNumber(json, "days", kLinkDaysMax));
  if (days == 0)
    return Status::InvalidArgument("a link must expire: say after how many 'days', 1 to " +
                                   std::to_string(kLinkDaysMax));
  constexpr uint64_t kNumberMax = std::numeric_limits<uint32_t>::max();
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t contribution,
                          OptionalNumber(json, "contribution", kNumberMax));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t reconstruction,
                          OptionalNumber(json, "reconstruction", kNumberMax));
  wanted.contribution = static_cast<uint32_t>(contribution);
  wanted.reconstruction = static_cast<uint32_t>(reconstruction);
  wanted.expires_unix_s = std::time(nullptr) + kDayS * static_cast<int64_t>(days);
  return engine->CreateToken(wanted);
}

HttpAnswer MakeLink(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<NewToken> made = MakeLinkOf(engine, request);
  return made.ok() ? JsonAnswer(201, LinkJson(*made)) : ProblemOf(made.status());
}

Status RevokeLinkOf(Engine* engine, const HttpRequest& request, const std::string& text) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t number, WholeNumber("a link's number", text, 1,
                                                             std::numeric_limits<uint32_t>::max()));
  VEDUTA_ASSIGN_OR_RETURN(const std::string actor, ActorOf(json, request));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<TokenAnswer> links, LinksOf(*engine));
  // Other tokens are for administrators to revoke.
  if (std::ranges::find(links, number, &TokenAnswer::number) == links.end())
    return Status::NotFound("there is no link " + text);
  return engine->RevokeToken(static_cast<uint32_t>(number), actor);
}

HttpAnswer RevokeLink(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Status revoked = RevokeLinkOf(engine, request, arguments[0]);
  return revoked.ok() ? JsonAnswer(200, Json::object()) : ProblemOf(revoked);
}

}  // namespace

std::vector<CityRoute> LinkRoutes() {
  constexpr Role kCurates = Role::kCurator;
  return {
      {"GET", {"v1", "links"}, {}, ListLinks, false, false, kCurates, true},
      {"POST", {"v1", "links"}, {}, MakeLink, false, false, kCurates, true},
      {"POST", {"v1", "links", "*", "revoke"}, {}, RevokeLink, false, false, kCurates, true},
  };
}

}  // namespace veduta
