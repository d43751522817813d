// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/rpc_failure.h"

namespace veduta {
namespace {

// When to try again, where the service does not say it. Chosen by hand.
constexpr const char* kRetryAfterS = "5";

kj::Exception FailureIn(uint32_t code, const std::string& detail, const std::string& retry_s) {
  const bool passes = code == 429 || code == 503;
  const std::string text = std::to_string(code) + " " + HttpPhrase(code) + ": " + detail +
                           (passes ? ", try again in " + retry_s + " s" : "");
  const auto type = passes ? kj::Exception::Type::OVERLOADED : kj::Exception::Type::FAILED;
  return kj::Exception(type, "veduta", 0, kj::heapString(text.data(), text.size()));
}

}  // namespace

kj::Exception FailureOf(const HttpAnswer& problem) {
  const Json json = Json::parse(problem.body, nullptr, /*allow_exceptions=*/false);
  std::string retry_s = kRetryAfterS;
  for (const auto& [name, value] : problem.headers) {
    if (name == "Retry-After") retry_s = value;
  }
  return FailureIn(problem.code, json.is_object() ? json.value("detail", "") : "", retry_s);
}

kj::Exception FailureOf(const Status& status) {
  return FailureOf(ProblemOf(status));
}

kj::Exception Failure(uint32_t code, const std::string& detail) {
  return FailureIn(code, detail, kRetryAfterS);
}

}  // namespace veduta
