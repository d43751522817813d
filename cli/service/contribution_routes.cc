// SPDX-License-Identifier: Apache-2.0
#include "cli/service/contribution_routes.h"

#include <limits>

#include "cli/service/path_numbers.h"
#include "cli/service/request_parts.h"
#include "cli/wire/contribution_json.h"

namespace veduta {
namespace {

// Contributions, or photos of one, in an answer, at most and by default. Chosen by hand.
constexpr uint64_t kCountMax = 1000;
// Of what is sent about one: a comment of 2000 bytes may be escaped. Chosen by hand.
constexpr size_t kBodyBytesMax = 64 << 10;

// With the verdicts of its photos in sum.
HttpAnswer Tell(const Engine& engine, uint32_t number, uint32_t code, const Sight& sight = {}) {
  const Questions ask = engine.Ask(sight);
  const auto contribution = ask.Contribution(number);
  if (!contribution.ok()) return ProblemOf(contribution.status());
  const auto sums = ask.ContributionVerdicts(number);
  if (!sums.ok()) return ProblemOf(sums.status());
  Json json = ToJson(*contribution);
  json["verdicts"] = ToJson(*sums);
  HttpAnswer answer = JsonAnswer(code, json);
  if (code == 201)
    answer.headers.emplace_back("Location", "/v1/contributions/" + std::to_string(number));
  return answer;
}

Result<ContributionRequest> RequestOf(const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request));
  VEDUTA_RETURN_IF_ERROR(RefuseOthers(json, {"comment", "licence", "contributor"}));
  ContributionRequest wanted;
  VEDUTA_ASSIGN_OR_RETURN(wanted.comment, OptionalText(json, "comment"));
  VEDUTA_ASSIGN_OR_RETURN(wanted.licence, OptionalText(json, "licence"));
  VEDUTA_ASSIGN_OR_RETURN(wanted.contributor, OptionalText(json, "contributor"));
  if (wanted.contributor.empty())
    wanted.contributor = request.who.empty() ? "anonymous" : request.who;
  wanted.actor = request.who.empty() ? wanted.contributor : request.who;
  return wanted;
}

HttpAnswer ListContributions(Engine* engine, const HttpRequest& request, const PathArguments&) {
  const auto from = NumberParameter(request, "from", 1, 1, std::numeric_limits<uint32_t>::max());
  if (!from.ok()) return ProblemOf(from.status());
  const auto count = NumberParameter(request, "count", kCountMax, 1, kCountMax);
  if (!count.ok()) return ProblemOf(count.status());
  const auto listed =
      engine->Ask(request.sight)
          .Contributions(static_cast<uint32_t>(*from), static_cast<uint32_t>(*count));
  return listed.ok() ? JsonAnswer(200, ToJson(*listed)) : ProblemOf(listed.status());
}

HttpAnswer OpenContribution(Engine* engine, const HttpRequest& request, const PathArguments&) {
  if (request.content_type != "application/json")
    return Problem(415, "the content type is '" + request.content_type +
                            "': a contribution is opened by application/json");
  if (auto refusal = RefuseLargeJson(request, kBodyBytesMax)) return *std::move(refusal);
  const Result<ContributionRequest> wanted = RequestOf(request);
  if (!wanted.ok()) return ProblemOf(wanted.status());
  if (wanted->contributor != request.who && !request.may_name_others)
    return Problem(403, "contributions are opened under the token's name, " + request.who +
                            ": leave 'contributor' out");
  const Result<uint32_t> opened = engine->OpenContribution(*wanted);
  return opened.ok() ? Tell(*engine, *opened, 201) : ProblemOf(opened.status());
}

HttpAnswer GetContribution(Engine* engine, const HttpRequest& request,
                           const PathArguments& arguments) {
  const Result<uint32_t> number = ContributionNumber(arguments[0]);
  return number.ok() ? Tell(*engine, *number, 200, request.sight) : ProblemOf(number.status());
}

HttpAnswer ListContributedPhotos(Engine* engine, const HttpRequest& request,
                                 const PathArguments& arguments) {
  const Result<uint32_t> number = ContributionNumber(arguments[0]);
  if (!number.ok()) return ProblemOf(number.status());
  const auto from = NumberParameter(request, "from", 1, 1, std::numeric_limits<uint64_t>::max());
  if (!from.ok()) return ProblemOf(from.status());
  const auto count = NumberParameter(request, "count", kCountMax, 1, kCountMax);
  if (!count.ok()) return ProblemOf(count.status());
  const auto photos =
      engine->Ask(request.sight).ContributedPhotos(*number, *from, static_cast<uint32_t>(*count));
  return photos.ok() ? JsonAnswer(200, ToJson(*photos)) : ProblemOf(photos.status());
}

HttpAnswer CloseContribution(Engine* engine, const HttpRequest& request,
                             const PathArguments& arguments) {
  const Result<uint32_t> number = ContributionNumber(arguments[0]);
  if (!number.ok()) return ProblemOf(number.status());
  const auto contribution = engine->Ask(request.sight).Contribution(*number);
  if (!contribution.ok()) return ProblemOf(contribution.status());
  if (!request.may_name_others && contribution->contributor != request.who)
    return Problem(403, "contribution " + arguments[0] + " is closed by its contributor, " +
                            contribution->contributor + ", or by a curator");
  const Status closed = engine->CloseContribution(
      *number, request.who.empty() ? contribution->contributor : request.who);
  return closed.ok() ? Tell(*engine, *number, 200, request.sight) : ProblemOf(closed);
}

}  // namespace

bool OpensContribution(const HttpRequest& request) {
  return request.method == "POST" && request.path.size() == 2 && request.path[1] == "contributions";
}

std::vector<CityRoute> ContributionRoutes() {
  constexpr Role kSends = Role::kContributor, kCurates = Role::kCurator;
  return {
      {"OPTIONS", {"v1", "tus"}, {}, nullptr, false, true, Role::kViewer, false, true},
      {"POST", {"v1", "tus"}, {}, nullptr, false, false, kSends},
      {"GET", {"v1", "tus", "*"}, {}, nullptr, false, true, kSends},
      {"PATCH", {"v1", "tus", "*"}, {}, nullptr, false, false, kSends},
      {"DELETE", {"v1", "tus", "*"}, {}, nullptr, false, false, kSends},
      {"GET", {"v1", "contributions"}, {"from", "count"}, ListContributions},
      {"POST", {"v1", "contributions"}, {}, OpenContribution, false, false, kSends},
      {"GET", {"v1", "contributions", "*"}, {}, GetContribution},
      {"DELETE", {"v1", "contributions", "*"}, {}, nullptr, false, false, kCurates, true},
      {"GET", {"v1", "contributions", "*", "photos"}, {"from", "count"}, ListContributedPhotos},
      {"POST", {"v1", "contributions", "*", "close"}, {}, CloseContribution, false, false, kSends},
  };
}

}  // namespace veduta
