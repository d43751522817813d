// SPDX-License-Identifier: Apache-2.0
#include "cli/service/quotas.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace veduta {
namespace {

constexpr double kDayS = 24 * 60 * 60;
// So many seconds' requests may come at once: a page asks for hundreds of pictures. Chosen by hand.
constexpr double kBurstS = 10;

HttpAnswer TooMany(const std::string& what, double missing, double per_s) {
  const auto wait_s = static_cast<uint64_t>(std::clamp(std::ceil(missing / per_s), 1.0, kDayS));
  HttpAnswer answer =
      Problem(429, what + " is used up: come again in " + std::to_string(wait_s) + " s");
  answer.headers.emplace_back("Retry-After", std::to_string(wait_s));
  return answer;
}

}  // namespace

void Quotas::Measure::Fill(double seconds) {
  left = std::min(full, left + per_s * seconds);
}

Quotas::Measures& Quotas::FilledMeasures(const HttpRequest& request) {
  const Clock::time_point now = now_();
  const auto [found, is_new] = measures_.try_emplace(request.token_number);
  Measures& measures = found->second;
  if (is_new) {
    const TokenQuota& own = request.quota;
    const double photos = own.photos_per_day != 0 ? own.photos_per_day : usual_.photos_per_day;
    const double requests = own.requests_per_s != 0 ? own.requests_per_s : usual_.requests_per_s;
    const auto bytes =
        static_cast<double>(own.bytes_per_day != 0 ? own.bytes_per_day : usual_.bytes_per_day);
    measures.photos = {photos, photos, photos / kDayS};
    measures.bytes = {bytes, bytes, bytes / kDayS};
    measures.requests = {kBurstS * requests, kBurstS * requests, requests};
    measures.filled = now;
  }
  const double seconds = std::chrono::duration<double>(now - measures.filled).count();
  for (Measure* const measure : {&measures.photos, &measures.bytes, &measures.requests})
    measure->Fill(seconds);
  measures.filled = now;
  return measures;
}

std::optional<HttpAnswer> Quotas::TakeRequest(const HttpRequest& request) {
  if (request.token_number == 0) return std::nullopt;
  const std::lock_guard lock(mutex_);
  Measure& requests = FilledMeasures(request).requests;
  if (requests.left < 1)
    return TooMany("the token's quota of requests", 1 - requests.left, requests.per_s);
  requests.left -= 1;
  return std::nullopt;
}

std::optional<HttpAnswer> Quotas::TakePhoto(const HttpRequest& request, uint64_t size_bytes) {
  if (request.token_number == 0) return std::nullopt;
  const std::lock_guard lock(mutex_);
  Measures& measures = FilledMeasures(request);
  const auto size = static_cast<double>(size_bytes);
  if (measures.photos.left < 1)
    return TooMany("the token's quota of photos", 1 - measures.photos.left, measures.photos.per_s);
  if (measures.bytes.left < size)
    return TooMany("the token's quota of bytes", size - measures.bytes.left, measures.bytes.per_s);
  measures.photos.left -= 1;
  measures.bytes.left -= size;
  return std::nullopt;
}

void Quotas::GivePhoto(const HttpRequest& request, uint64_t size_bytes) {
  if (request.token_number == 0) return;
  const std::lock_guard lock(mutex_);
  Measures& measures = FilledMeasures(request);
  measures.photos.left = std::min(measures.photos.full, measures.photos.left + 1);
  measures.bytes.left =
      std::min(measures.bytes.full, measures.bytes.left + static_cast<double>(size_bytes));
}

}  // namespace veduta
