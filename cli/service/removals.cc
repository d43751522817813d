// SPDX-License-Identifier: Apache-2.0
#include "cli/service/removals.h"

#include <limits>
#include <string>

#include "cli/service/path_numbers.h"
#include "cli/service/request_parts.h"
#include "cli/wire/removal_json.h"

namespace veduta {
namespace {

// Some 50,000 names of photos. Chosen by hand.
constexpr size_t kBodyBytesMax = 4 << 20;

// What the body names.
Result<RemoveRequest> RequestOfBody(const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json json, JsonObjectOf(request, kBodyBytesMax));
  RemoveRequest wanted;
  const Json photos = json.value("photos", Json::array());
  if (!photos.is_array()) return Status::InvalidArgument("'photos' is no array");
  for (const Json& photo : photos) {
    if (!photo.is_string()) return Status::InvalidArgument("'photos' has what is no text");
    wanted.photos.push_back(photo.get<std::string>());
  }
  VEDUTA_ASSIGN_OR_RETURN(wanted.contributor, OptionalText(json, "contributor"));
  VEDUTA_ASSIGN_OR_RETURN(
      const uint64_t contribution,
      OptionalNumber(json, "contribution", std::numeric_limits<uint32_t>::max()));
  wanted.contribution = static_cast<uint32_t>(contribution);
  VEDUTA_ASSIGN_OR_RETURN(wanted.actor, ActorOf(json, request));
  VEDUTA_ASSIGN_OR_RETURN(wanted.why, OptionalText(json, "why"));
  return wanted;
}

// The contribution that the path names.
Result<RemoveRequest> RequestOfPath(const HttpRequest& request) {
  RemoveRequest wanted;
  VEDUTA_ASSIGN_OR_RETURN(wanted.contribution, ContributionNumber(request.path.back()));
  if (!request.who.empty()) wanted.actor = request.who;
  return wanted;
}

// kNotFound where something of it is not there.
Status Find(const Questions& ask, const RemoveRequest& wanted) {
  for (const std::string& photo : wanted.photos) VEDUTA_RETURN_IF_ERROR(ask.Image(photo).status());
  return wanted.contribution == 0 ? Status::Ok() : ask.Contribution(wanted.contribution).status();
}

}  // namespace

HttpAnswer Removals::Answer(const HttpRequest& request) {
  if (auto refusal = RefuseLargeJson(request, kBodyBytesMax)) return *std::move(refusal);
  const Result<RemoveRequest> wanted =
      request.method == "DELETE" ? RequestOfPath(request) : RequestOfBody(request);
  if (!wanted.ok()) return ProblemOf(wanted.status());
  if (const Status right = wanted->Check(); !right.ok()) return ProblemOf(right);
  if (const Status found = Find(engine_->Ask(), *wanted); !found.ok()) return ProblemOf(found);
  const DenseKeeper::Rest rest(keeper_);  // a removal cannot go beside a pass
  const auto removed = engine_->Remove(*wanted, stop_.get_token());
  if (!removed.ok()) return ProblemOf(removed.status());
  engine_->Settle(stop_.get_token())
      .IgnoreBecause("the daemon settles again in a while, and tells of failures then");
  return JsonAnswer(200, ToJson(*removed));
}

}  // namespace veduta
