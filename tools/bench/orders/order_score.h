// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far the photos of a run are from where they were taken.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/bench/orders/order_run.h"
#include "tools/bench/orders/truth_folder.h"

namespace veduta::orders {

// A photo is wrong whose centre or rotation is over the limit.
struct Limits {
  double center_m = 0.5;      // > 0; in the unit of the truth
  double rotation_deg = 2.0;  // (0, 180]
};

// The limit for centres: the larger one of `error_m` and `error_share` of the extent, where both
// are given; 0.5 m and 0.005 where neither is.
double CenterLimit(std::optional<double> error_m, std::optional<double> error_share,
                   double extent_m);

// Of one reconstruction, or of all placed photos of a run, each against the fit of its own
// reconstruction.
struct GroupScore {
  uint32_t reconstruction = 0;
  uint32_t photos = 0;     // with truth
  bool is_fitted = false;  // false: fewer than three photos, or all of them on one place
  // The centres determine the similarity's rotation too badly, so rotations are compared after the
  // rotation that fits the rotations best. That is so for few photos along a line.
  bool is_rotation_apart = false;
  double center_mean_m = 0, center_median_m = 0, center_max_m = 0;
  double rotation_max_deg = 0;
  uint32_t wrong = 0;         // photos over the limits
  uint32_t wrong_robust = 0;  // the same after a robust fit, which a few bad photos do not bend
  // The photo that is farthest over the limits, or nearest to them, after the robust fit.
  std::string worst;
};

struct OrderScore {
  std::vector<GroupScore> reconstructions;  // most photos first, then ascending ids
  GroupScore all;                           // of those that could be fitted
  uint32_t without_truth = 0;               // placed photos; not scored
  bool is_wrong = false;                    // the run failed, or a photo is over the limits
};

// Fits truth_from_reconstruction by the centres (Umeyama 1991), for each reconstruction. The robust
// fit is the similarity of three photos with the least median error (Rousseeuw 1984), of 500 seeded
// triples, fitted again to the photos near it. Deterministic. O(photos * 500).
OrderScore ScoreRun(const OrderRun& run, const Truth& truth, const Limits& limits);

}  // namespace veduta::orders
