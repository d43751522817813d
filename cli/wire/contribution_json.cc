// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/contribution_json.h"

namespace veduta {
namespace {

// Null where there is none.
template <typename Number>
Json OrNull(Number number) {
  return number == 0 ? Json(nullptr) : Json(number);
}

}  // namespace

Json ToJson(const PartialUploadAnswer& partial) {
  return {{"image", partial.name},          {"contributor", partial.contributor},
          {"camera", partial.camera},       {"contribution", OrNull(partial.contribution)},
          {"length", partial.length_bytes}, {"offset", partial.received_bytes},
          {"time", partial.begun_unix_s},   {"upload", OrNull(partial.upload)}};
}

Json ToJson(const ContributionAnswer& contribution) {
  return {{"contribution", contribution.number},  {"contributor", contribution.contributor},
          {"comment", contribution.comment},      {"licence", contribution.licence},
          {"opened", contribution.opened_unix_s}, {"closed", OrNull(contribution.closed_unix_s)},
          {"photos", contribution.photos},        {"hidden", contribution.is_hidden}};
}

Json ToJson(const ContributionSums& sums) {
  Json reasons = Json::array();
  for (const auto& [reason, count] : sums.reasons)
    reasons.push_back({{"reason", ReasonSentence(reason, "")}, {"photos", count}});
  return {
      {"arriving", sums.arriving},   {"waiting", sums.waiting}, {"placed", sums.placed},
      {"postponed", sums.postponed}, {"refused", sums.refused}, {"duplicates", sums.duplicates},
      {"failed", sums.failed},       {"removed", sums.removed}, {"reasons", std::move(reasons)}};
}

Json ToJson(const ContributedPhotoAnswer& photo) {
  return {{"upload", photo.upload},
          {"image", photo.name},
          {"state", photo.state},
          {"id", ToJson(photo.image)},
          {"reason",
           photo.reason == Reason::kNone ? Json(nullptr) : Json(ReasonSentence(photo.reason, ""))}};
}

}  // namespace veduta
