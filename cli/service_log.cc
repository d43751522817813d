// SPDX-License-Identifier: Apache-2.0
#include "cli/service_log.h"

#include <chrono>
#include <cstdio>
#include <ctime>

#include "cli/printable.h"
#include "cli/wire/added_json.h"

namespace veduta {
namespace {

// "2026-11-24T03:00:00.123Z", as RFC 3339 has it.
std::string Now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  const time_t seconds = ms / 1000;
  std::tm parts{};
  char text[40] = "";
  if (gmtime_r(&seconds, &parts)) std::strftime(text, sizeof(text), "%FT%T", &parts);
  char fraction[8];
  std::snprintf(fraction, sizeof(fraction), ".%03dZ", static_cast<int>(ms % 1000));
  return std::string(text) + fraction;
}

}  // namespace

std::map<std::string, LogFormat> LogFormats() {
  return {{"none", LogFormat::kNone}, {"text", LogFormat::kText}, {"json", LogFormat::kJson}};
}

Json PhotoLogJson(uint64_t upload, const std::string& name, const Result<AddOutcome>& outcome) {
  Json json = {{"upload", upload == 0 ? Json() : Json(upload)}, {"image", name}};
  if (outcome.ok()) {
    json["id"] = ToJson(outcome->id);
    json["verdict"] = OutcomeWord(*outcome);
    json["reason"] = OutcomeReason(*outcome);
    json["ms"] = outcome->times.total_ms;
  } else {
    json["verdict"] = "failed";
    json["reason"] = outcome.status().message();
  }
  return json;
}

void WriteLog(const Json& object, LogFormat format) {
  Json timed = {{"time", Now()}};
  timed.update(object);
  std::string line = JsonLine(timed);
  if (format == LogFormat::kText) {
    line.clear();
    for (const auto& [key, value] : timed.items()) {
      if (!value.is_null()) line += (line.empty() ? "" : " ") + key + "=" + JsonLine(value);
    }
    line = Printable(line);
  }
  std::fprintf(stderr, "%s\n", line.c_str());  // one write, so that lines stay whole
}

std::function<void(const RequestEntry&)> RequestLog(LogFormat format) {
  if (format == LogFormat::kNone) return {};
  return [format](const RequestEntry& entry) { WriteLog(ToJson(entry), format); };
}

}  // namespace veduta
