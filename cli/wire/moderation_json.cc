// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/moderation_json.h"

namespace veduta {
namespace {

// Null where there is none.
Json TextOf(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

}  // namespace

Json ToJson(const HiddenAnswer& hidden) {
  const bool is_image = hidden.kind == HiddenKind::kImage;
  return {{"id", is_image ? Json(hidden.number) : Json(nullptr)},
          {"image", TextOf(hidden.name)},
          {"contribution", is_image ? Json(nullptr) : Json(hidden.number)},
          {"time", hidden.time_unix_s},
          {"actor", hidden.actor},
          {"reason", hidden.reason}};
}

Json ToJson(const ReportAnswer& report) {
  return {{"report", report.number},
          {"id", report.image.value},
          {"image", TextOf(report.name)},
          {"reason", ReportReasonWord(report.reason)},
          {"text", report.text},
          {"reporter", report.reporter},
          {"time", report.time_unix_s},
          {"state", ReportStateWord(report.state)},
          {"resolver", TextOf(report.resolver)},
          {"resolved", report.resolved_unix_s == 0 ? Json(nullptr) : Json(report.resolved_unix_s)}};
}

}  // namespace veduta
