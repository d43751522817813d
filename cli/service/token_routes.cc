// SPDX-License-Identifier: Apache-2.0
#include "cli/service/token_routes.h"

#include <limits>

#include "cli/service/path_numbers.h"
#include "cli/service/request_parts.h"
#include "cli/wire/token_json.h"

namespace veduta {
namespace {

HttpAnswer ListTokens(Engine* engine, const HttpRequest&, const PathArguments&) {
  const auto tokens = engine->Ask().Tokens();
  return tokens.ok() ? JsonAnswer(200, ToJson(*tokens)) : ProblemOf(tokens.status());
}

Result<NewToken> MakeTokenOf(Engine* engine, const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  TokenRequest wanted;
  VEDUTA_ASSIGN_OR_RETURN(wanted.name, TextMember(json, "name"));
  VEDUTA_ASSIGN_OR_RETURN(const std::string role, TextMember(json, "role"));
  VEDUTA_ASSIGN_OR_RETURN(wanted.role, ParseRole(role));
  VEDUTA_ASSIGN_OR_RETURN(wanted.actor, ActorOf(json, request));
  const Json expires = json.value("expires", Json());
  if (!expires.is_null() && !expires.is_number_integer())
    return Status::InvalidArgument("'expires' is no whole number of seconds since 1970");
  if (!expires.is_null()) wanted.expires_unix_s = expires.get<int64_t>();
  constexpr uint64_t kMax = std::numeric_limits<uint32_t>::max();
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t photos, OptionalNumber(json, "photos_per_day", kMax));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t requests,
                          OptionalNumber(json, "requests_per_second", kMax));
  VEDUTA_ASSIGN_OR_RETURN(wanted.quota.bytes_per_day,
                          OptionalNumber(json, "bytes_per_day", UINT64_MAX));
  wanted.quota.photos_per_day = static_cast<uint32_t>(photos);
  wanted.quota.requests_per_s = static_cast<uint32_t>(requests);
  wanted.is_link = json.value("link", Json()) == true;
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t contribution, OptionalNumber(json, "contribution", kMax));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t reconstruction,
                          OptionalNumber(json, "reconstruction", kMax));
  wanted.contribution = static_cast<uint32_t>(contribution);
  wanted.reconstruction = static_cast<uint32_t>(reconstruction);
  return engine->CreateToken(wanted);
}

HttpAnswer MakeToken(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Result<NewToken> made = MakeTokenOf(engine, request);
  return made.ok() ? JsonAnswer(201, ToJson(*made)) : ProblemOf(made.status());
}

Status RevokeTokenOf(Engine* engine, const HttpRequest& request, const std::string& number) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t parsed, WholeNumber("a token's number", number, 1,
                                                             std::numeric_limits<uint32_t>::max()));
  VEDUTA_ASSIGN_OR_RETURN(const std::string actor, ActorOf(json, request));
  return engine->RevokeToken(static_cast<uint32_t>(parsed), actor);
}

HttpAnswer RevokeToken(Engine* engine, const HttpRequest& request, const PathArguments& arguments) {
  if (auto refusal = RefuseLargeJson(request)) return *std::move(refusal);
  const Status revoked = RevokeTokenOf(engine, request, arguments[0]);
  return revoked.ok() ? JsonAnswer(200, Json::object()) : ProblemOf(revoked);
}

}  // namespace

std::vector<CityRoute> TokenRoutes() {
  constexpr Role kRules = Role::kAdmin;
  return {
      {"GET", {"v1", "tokens"}, {}, ListTokens, false, false, kRules, true},
      {"POST", {"v1", "tokens"}, {}, MakeToken, false, false, kRules, true},
      {"POST", {"v1", "tokens", "*", "revoke"}, {}, RevokeToken, false, false, kRules, true},
  };
}

}  // namespace veduta
