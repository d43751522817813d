// SPDX-License-Identifier: Apache-2.0
#include "cli/daemon_json.h"

namespace veduta {

std::string DetailOf(const HttpAnswer& answer) {
  const Json json = Json::parse(answer.body, nullptr, /*allow_exceptions=*/false);
  const auto detail = json.is_object() ? json.find("detail") : json.end();
  if (detail != json.end() && detail->is_string()) return detail->get<std::string>();
  return "the daemon answers " + std::to_string(answer.code);
}

Status StatusOfProblem(const Json& problem) {
  const std::string detail = problem.value("detail", "");
  if (problem.value("damaged", false)) return Status::Corruption(detail);
  if (problem.value("status", 0) == 503) return Status::Busy(detail);
  return Status::InvalidArgument(detail);
}

Result<Json> AskForJson(DaemonClient* daemon, const DaemonClient::Question& question) {
  VEDUTA_ASSIGN_OR_RETURN(const HttpAnswer answer, daemon->Ask(question));
  Json json = Json::parse(answer.body, nullptr, /*allow_exceptions=*/false);
  if (answer.code >= 300 && json.is_object() && json.contains("detail"))
    return StatusOfProblem(json);
  if (answer.code >= 300) return Status::InvalidArgument(DetailOf(answer));
  if (!json.is_object()) return Status::IoError("the daemon's answer is no JSON object");
  return json;
}

Result<Json> Post(DaemonClient* daemon, const std::string& path, const Json& json) {
  const std::string text = JsonLine(json);
  DaemonClient::Question question{"POST", path, "application/json", {}};
  question.body = {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
  return AskForJson(daemon, question);
}

}  // namespace veduta
