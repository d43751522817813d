// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/orders/order_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "storage/base/median.h"

namespace veduta::orders {
namespace {

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

OrdersSummary::Spread SpreadOf(std::vector<double> values) {
  if (values.empty()) return {};
  OrdersSummary::Spread spread;
  const auto [least, most] = std::ranges::minmax(values);
  spread.least = least, spread.most = most;
  spread.median = QuantileInPlace(values, 0.5);
  spread.p90 = QuantileInPlace(values, 0.9);
  spread.p99 = QuantileInPlace(values, 0.99);
  return spread;
}

double ShareOf(size_t count, const OrderRun& run) {
  return run.photos == 0 ? 0 : static_cast<double>(count) / run.photos;
}

std::string GroupText(const GroupScore& group) {
  if (!group.is_fitted) return Format("%u photos, too few to fit", group.photos);
  std::string text = Format(
      "%u photos, centre mean %.4f m, median %.4f m, max %.4f m; rotation max %.3f degrees%s; "
      "worst ",
      group.photos, group.center_mean_m, group.center_median_m, group.center_max_m,
      group.rotation_max_deg, group.is_rotation_apart ? " (aligned apart)" : "");
  return text + group.worst +
         Format("; over the limit: %u, by the robust fit %u", group.wrong, group.wrong_robust);
}

nlohmann::json GroupJson(const GroupScore& group) {
  nlohmann::json json = {{"photos", group.photos}, {"fitted", group.is_fitted}};
  if (!group.is_fitted) return json;
  json["center_mean_m"] = group.center_mean_m;
  json["center_median_m"] = group.center_median_m;
  json["center_max_m"] = group.center_max_m;
  json["rotation_max_deg"] = group.rotation_max_deg;
  json["worst"] = group.worst;
  json["wrong"] = group.wrong;
  json["wrong_robust"] = group.wrong_robust;
  return json;
}

nlohmann::json SpreadJson(const OrdersSummary::Spread& spread) {
  return {{"least", spread.least},
          {"median", spread.median},
          {"p90", spread.p90},
          {"p99", spread.p99},
          {"most", spread.most}};
}

// How far over the limits the worst photo of a run is: 1 is at the limit.
double Badness(const ScoredRun& scored, const Limits& limits) {
  if (!scored.run.failure.empty()) return HUGE_VAL;
  return std::max(scored.score.all.center_max_m / limits.center_m,
                  scored.score.all.rotation_max_deg / limits.rotation_deg);
}

}  // namespace

OrdersSummary Summarize(std::span<const ScoredRun> runs, const Limits& limits) {
  OrdersSummary summary;
  std::vector<double> placed, told, count, mean, most, rotation, seconds;
  double worst = -1;
  for (const ScoredRun& scored : runs) {
    const bool has_failed = !scored.run.failure.empty();
    ++summary.orders;
    summary.failed += has_failed ? 1 : 0;
    summary.wrong += scored.score.is_wrong ? 1 : 0;
    summary.wrong_robust += has_failed || scored.score.all.wrong_robust > 0 ? 1 : 0;
    summary.complete += scored.run.photos > 0 && scored.run.placed == scored.run.photos ? 1 : 0;
    if (Badness(scored, limits) > worst)
      worst = Badness(scored, limits), summary.worst = scored.run.label;
    placed.push_back(ShareOf(scored.run.placed, scored.run));
    told.push_back(ShareOf(scored.run.poses.size(), scored.run));
    if (!scored.score.all.is_fitted) continue;
    count.push_back(static_cast<double>(scored.score.reconstructions.size()));
    mean.push_back(scored.score.all.center_mean_m);
    most.push_back(scored.score.all.center_max_m);
    rotation.push_back(scored.score.all.rotation_max_deg);
    seconds.push_back(scored.run.seconds);
  }
  summary.placed_share = SpreadOf(std::move(placed));
  summary.told_share = SpreadOf(std::move(told));
  summary.reconstructions = SpreadOf(std::move(count));
  summary.center_mean_m = SpreadOf(std::move(mean));
  summary.center_max_m = SpreadOf(std::move(most));
  summary.rotation_max_deg = SpreadOf(std::move(rotation));
  summary.seconds = SpreadOf(std::move(seconds));
  return summary;
}

std::string RunReport(const ScoredRun& scored) {
  const OrderRun& run = scored.run;
  const OrderScore& score = scored.score;
  std::string text =
      run.label + Format(
                      ": %s; %u photos: %u placed (%zu told where), %u postponed, %u "
                      "rejected, %u failed; %zu reconstructions; %.1f s\n",
                      score.is_wrong ? "WRONG" : "right", run.photos, run.placed, run.poses.size(),
                      run.postponed, run.rejected, run.failed, score.reconstructions.size(),
                      run.seconds);
  if (run.answer_most_s > 0)
    text += Format("  answers within %.2f s (half), %.2f s (99 %%), %.2f s (all)\n",
                   run.answer_median_s, run.answer_p99_s, run.answer_most_s);
  if (!run.failure.empty()) text += "  failed: " + run.failure + "\n";
  for (const GroupScore& group : score.reconstructions)
    text += Format("  reconstruction %u: ", group.reconstruction) + GroupText(group) + "\n";
  if (score.reconstructions.size() > 1 && score.all.is_fitted)
    text += "  all: " + GroupText(score.all) + "\n";
  if (score.without_truth > 0) text += Format("  %u photos without truth\n", score.without_truth);
  if (!run.kept.empty()) text += "  kept in " + run.kept + "\n";
  return text;
}

std::string SummaryReport(const OrdersSummary& summary, const Limits& limits) {
  const auto share = [&](uint32_t count) {
    return summary.orders == 0 ? 0 : 100.0 * count / summary.orders;
  };
  std::string text = Format(
      "%u of %u orders wrong (%.1f %%; %u by the robust fit; %u failed): a photo over %.4g m or "
      "%.4g degrees\nall photos placed in %u orders (%.1f %%)\n",
      summary.wrong, summary.orders, share(summary.wrong), summary.wrong_robust, summary.failed,
      limits.center_m, limits.rotation_deg, summary.complete, share(summary.complete));
  if (summary.orders > 0) text += "worst order: " + summary.worst + "\n";
  text += Format("%-26s %10s %10s %10s %10s %10s\n", "of an order", "least", "median", "90 %",
                 "99 %", "most");
  const std::pair<const char*, const OrdersSummary::Spread*> rows[] = {
      {"share placed", &summary.placed_share},
      {"share told where", &summary.told_share},
      {"reconstructions", &summary.reconstructions},
      {"centre error, mean, m", &summary.center_mean_m},
      {"centre error, largest, m", &summary.center_max_m},
      {"rotation, largest, degrees", &summary.rotation_max_deg},
      {"seconds", &summary.seconds}};
  for (const auto& [name, spread] : rows) {
    text += Format("%-26s %10.4f %10.4f %10.4f %10.4f %10.4f\n", name, spread->least,
                   spread->median, spread->p90, spread->p99, spread->most);
  }
  return text;
}

nlohmann::json RunJson(const ScoredRun& scored) {
  const OrderRun& run = scored.run;
  nlohmann::json json = {{"order", run.label},       {"wrong", scored.score.is_wrong},
                         {"photos", run.photos},     {"placed", run.placed},
                         {"told", run.poses.size()}, {"postponed", run.postponed},
                         {"rejected", run.rejected}, {"failed", run.failed},
                         {"seconds", run.seconds},   {"all", GroupJson(scored.score.all)}};
  if (run.answer_most_s > 0) {
    json["answer_s"] = {
        {"median", run.answer_median_s}, {"p99", run.answer_p99_s}, {"most", run.answer_most_s}};
  }
  if (!run.failure.empty()) json["failure"] = run.failure;
  if (!run.kept.empty()) json["kept"] = run.kept;
  json["reconstructions"] = nlohmann::json::array();
  for (const GroupScore& group : scored.score.reconstructions) {
    nlohmann::json one = GroupJson(group);
    one["id"] = group.reconstruction;
    json["reconstructions"].push_back(std::move(one));
  }
  return json;
}

nlohmann::json SummaryJson(const OrdersSummary& summary, const Limits& limits) {
  return {{"orders", summary.orders},
          {"wrong", summary.wrong},
          {"wrong_robust", summary.wrong_robust},
          {"failed", summary.failed},
          {"complete", summary.complete},
          {"worst", summary.worst},
          {"error_m_max", limits.center_m},
          {"error_deg_max", limits.rotation_deg},
          {"placed_share", SpreadJson(summary.placed_share)},
          {"told_share", SpreadJson(summary.told_share)},
          {"reconstructions", SpreadJson(summary.reconstructions)},
          {"center_mean_m", SpreadJson(summary.center_mean_m)},
          {"center_max_m", SpreadJson(summary.center_max_m)},
          {"rotation_max_deg", SpreadJson(summary.rotation_max_deg)},
          {"seconds", SpreadJson(summary.seconds)}};
}

}  // namespace veduta::orders
