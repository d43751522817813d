// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is said of runs: a few lines for each, and the table over all of them.

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "tools/bench/orders/order_score.h"

namespace veduta::orders {

struct ScoredRun {
  OrderRun run;
  OrderScore score;
};

// Over all runs of a set.
struct OrdersSummary {
  uint32_t orders = 0, failed = 0;
  uint32_t wrong = 0;         // orders with a photo over the limits, and those that failed
  uint32_t wrong_robust = 0;  // the same by the robust fit
  uint32_t complete = 0;      // orders with every photo placed
  std::string worst;          // the label of the order with the photo farthest over the limits
  struct Spread {
    double least = 0, median = 0, p90 = 0, p99 = 0, most = 0;
  };
  // Of the orders that have a score: one number for each. A photo that is not sure where it stands
  // is placed, and not told where.
  Spread placed_share, told_share, reconstructions, center_mean_m, center_max_m, rotation_max_deg,
      seconds;
};

OrdersSummary Summarize(std::span<const ScoredRun> runs, const Limits& limits);

// Ends with a newline.
std::string RunReport(const ScoredRun& scored);
std::string SummaryReport(const OrdersSummary& summary, const Limits& limits);

// {"order": ..., "photos": ..., "reconstructions": [...], "all": {...}, ...}
nlohmann::json RunJson(const ScoredRun& scored);
nlohmann::json SummaryJson(const OrdersSummary& summary, const Limits& limits);

}  // namespace veduta::orders
