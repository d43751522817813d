// SPDX-License-Identifier: Apache-2.0
#include "cli/service/quotas.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "cli/service/remote_address.h"

namespace veduta {
namespace {

constexpr double kDayS = 24 * 60 * 60;
// So many seconds' requests may come at once: a page asks for hundreds of pictures. Chosen by hand.
constexpr double kBurstS = 10;
// Reports of photos a day, of each token. Chosen by hand: more than a person finds.
constexpr double kReportsPerDay = 100;
// The same of each address, with whatever tokens. Chosen by hand: people may share an address.
constexpr double kReportsPerAddressPerDay = 200;
// Contributions that are opened a day, of each token. Chosen by hand: each is a record that stays,
// and a person who photographs all day opens a hundred.
constexpr double kContributionsPerDay = 1000;
// Addresses that are counted at the same time. Chosen by hand: each takes some 100 bytes.
constexpr size_t kAddressesMax = 10'000;

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

void Quotas::Restore(std::span<const TokenUse> uses) {
  const std::lock_guard lock(mutex_);
  for (const TokenUse& use : uses) restored_[use.token] = use;
}

Quotas::Measures& Quotas::FilledMeasures(const HttpRequest& request) {
  const Clock::time_point now = world_.now();
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
    measures.reports = {kReportsPerDay, kReportsPerDay, kReportsPerDay / kDayS};
    measures.contributions = {kContributionsPerDay, kContributionsPerDay,
                              kContributionsPerDay / kDayS};
    measures.filled = now;
    if (const auto used = restored_.find(request.token_number); used != restored_.end()) {
      measures.photos.left -= used->second.photos;
      measures.bytes.left -= used->second.bytes;
      measures.reports.left -= used->second.reports;
      measures.contributions.left -= used->second.contributions;
      // What was filled since; nothing where the clock was put back.
      const auto passed_ms = static_cast<double>(world_.unix_ms() - used->second.time_unix_ms);
      for (Measure* const measure :
           {&measures.photos, &measures.bytes, &measures.reports, &measures.contributions})
        measure->Fill(std::max(passed_ms, 0.0) / 1000);
      restored_.erase(used);
    }
  }
  const double seconds = std::chrono::duration<double>(now - measures.filled).count();
  for (Measure* const measure : {&measures.photos, &measures.bytes, &measures.requests,
                                 &measures.reports, &measures.contributions})
    measure->Fill(seconds);
  measures.filled = now;
  return measures;
}

Quotas::Measure& Quotas::FilledReports(const std::string& address) {
  const Clock::time_point now = world_.now();
  const auto fill = [&](AddressMeasure* one) {
    one->reports.Fill(std::chrono::duration<double>(now - one->filled).count());
    one->filled = now;
  };
  auto found = addresses_.find(address);
  if (found == addresses_.end()) {
    if (addresses_.size() >= kAddressesMax) {
      for (auto& [other, measure] : addresses_) fill(&measure);
      addresses_.erase(std::ranges::max_element(
          addresses_, {}, [](const auto& one) { return one.second.reports.left; }));
    }
    constexpr double kFull = kReportsPerAddressPerDay;
    found = addresses_.emplace(address, AddressMeasure{{kFull, kFull, kFull / kDayS}, now}).first;
  }
  fill(&found->second);
  return found->second.reports;
}

std::optional<HttpAnswer> Quotas::TakeOne(const char* what, Measure* measure) {
  if (measure->left < 1) return TooMany(what, 1 - measure->left, measure->per_s);
  measure->left -= 1;
  return std::nullopt;
}

std::optional<HttpAnswer> Quotas::TakeRequest(const HttpRequest& request) {
  if (request.token_number == 0) return std::nullopt;
  const std::lock_guard lock(mutex_);
  return TakeOne("the token's quota of requests", &FilledMeasures(request).requests);
}

std::optional<HttpAnswer> Quotas::TakePhoto(const HttpRequest& request, uint64_t size_bytes) {
  if (request.token_number == 0) return std::nullopt;
  auto refusal = TryPhoto(request, static_cast<double>(size_bytes));
  if (!refusal) Keep(request);
  return refusal;
}

std::optional<HttpAnswer> Quotas::TakeReport(const HttpRequest& request) {
  if (request.is_of_owner) return std::nullopt;
  {
    const std::lock_guard lock(mutex_);
    Measure& reports = FilledMeasures(request).reports;
    if (reports.left < 1) return TooMany("the quota of reports", 1 - reports.left, reports.per_s);
    Measure& of_address = FilledReports(SenderOf(request.address));
    if (of_address.left < 1)
      return TooMany("the quota of reports from your address", 1 - of_address.left,
                     of_address.per_s);
    reports.left -= 1;
    of_address.left -= 1;
  }
  Keep(request);
  return std::nullopt;
}

std::optional<HttpAnswer> Quotas::TakeContribution(const HttpRequest& request) {
  if (request.token_number == 0) return std::nullopt;
  std::optional<HttpAnswer> refusal;
  {
    const std::lock_guard lock(mutex_);
    refusal = TakeOne("the token's quota of contributions", &FilledMeasures(request).contributions);
  }
  if (!refusal) Keep(request);
  return refusal;
}

void Quotas::Keep(const HttpRequest& request) {
  if (!world_.keep) return;
  const std::lock_guard one_at_a_time(keep_mutex_);
  TokenUse use;
  use.token = request.token_number;
  use.time_unix_ms = world_.unix_ms();
  {
    const std::lock_guard lock(mutex_);
    const Measures& measures = FilledMeasures(request);
    use.photos = measures.photos.full - measures.photos.left;
    use.bytes = measures.bytes.full - measures.bytes.left;
    use.reports = measures.reports.full - measures.reports.left;
    use.contributions = measures.contributions.full - measures.contributions.left;
  }
  world_.keep(use);
}

std::optional<HttpAnswer> Quotas::TryPhoto(const HttpRequest& request, double size) {
  const std::lock_guard lock(mutex_);
  Measures& measures = FilledMeasures(request);
  if (measures.photos.left < 1)
    return TooMany("the token's quota of photos", 1 - measures.photos.left, measures.photos.per_s);
  if (measures.bytes.left < size)
    return TooMany("the token's quota of bytes", size - measures.bytes.left, measures.bytes.per_s);
  measures.photos.left -= 1;
  measures.bytes.left -= size;
  return std::nullopt;
}

void Quotas::GivePhoto(const HttpRequest& request, uint64_t size_bytes, double after_s) {
  const double share = 1 - std::clamp(after_s / kDayS, 0.0, 1.0);
  if (request.token_number == 0 || share == 0) return;
  {
    const std::lock_guard lock(mutex_);
    Measures& measures = FilledMeasures(request);
    measures.photos.left = std::min(measures.photos.full, measures.photos.left + share);
    measures.bytes.left = std::min(measures.bytes.full,
                                   measures.bytes.left + share * static_cast<double>(size_bytes));
  }
  Keep(request);
}

}  // namespace veduta
