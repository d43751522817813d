// SPDX-License-Identifier: Apache-2.0
#include "engine/features/gaussian_taps.h"

#include <algorithm>
#include <cmath>

#include "engine/features/exact_math.h"

namespace veduta {
namespace {

constexpr int kOne = 1 << 15;
constexpr double kReachSigma = 3.6;  // where the filters end; chosen by hand

}  // namespace

GaussianTaps MakeGaussianTaps(double sigma) {
  GaussianTaps result;
  result.radius =
      std::clamp(static_cast<int>(std::ceil(kReachSigma * sigma - 0.5)), 1, kTapRadiusMax);
  double weights[kTapRadiusMax + 1];
  double width = sigma;
  double sum = 0;
  // Truncation and sampling change the variance: each pass corrects the width by what is missing.
  for (int pass = 0; pass < 8; ++pass) {
    sum = 0;
    double variance = 0;
    for (int k = 0; k <= result.radius; ++k) {
      weights[k] = ExactExp(-0.5 * k * k / (width * width));
      sum += (k == 0 ? 1 : 2) * weights[k];
      variance += 2 * weights[k] * k * k;
    }
    width *= std::sqrt(sigma * sigma / (variance / sum));
  }
  int rest = kOne;
  for (int k = 1; k <= result.radius; ++k) {
    result.taps[k] = static_cast<int16_t>(weights[k] / sum * kOne + 0.5);
    rest -= 2 * result.taps[k];
  }
  result.taps[0] = static_cast<int16_t>(std::clamp(rest, 0, kOne - 1));
  return result;
}

ShiftedTaps MakeQuarterStepTaps(double sigma) {
  ShiftedTaps result;
  const int reach =
      std::clamp(static_cast<int>(std::ceil(kReachSigma * sigma - 0.5)), 1, kTapRadiusMax);
  result.count = 2 * reach + 1;
  double weights[2 * kTapRadiusMax + 1];
  double first = 0, second = 0;
  for (int k = 0; k < result.count; ++k) {
    const double offset = k - reach + 0.25;
    weights[k] = ExactExp(-0.5 * offset * offset / (sigma * sigma));
    first += weights[k] * offset;
    second += weights[k] * offset * offset;
  }
  double sum = 0;
  for (int k = 0; k < result.count; ++k) {
    weights[k] = std::max(0.0, weights[k] * (1.0 - first / second * (k - reach + 0.25)));
    sum += weights[k];
  }
  int rest = kOne;
  for (int k = 0; k < result.count; ++k) {
    result.taps[k] = static_cast<int16_t>(weights[k] / sum * kOne + 0.5);
    rest -= result.taps[k];
  }
  result.taps[reach] = static_cast<int16_t>(result.taps[reach] + rest);
  return result;
}

}  // namespace veduta
