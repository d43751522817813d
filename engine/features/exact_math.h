// SPDX-License-Identifier: Apache-2.0
#pragma once
// Elementary functions with the same bits on every processor: the C library's choose a version by
// the processor's features, and the versions round differently. Relative error below 1e-14 in the
// ranges stated.

#include <cstdint>

#include "storage/base/angle.h"

namespace veduta {

// 2^v for |v| < 1000.
inline double ExactExp2(double v) {
  const double n = static_cast<double>(static_cast<int64_t>(v + (v < 0 ? -0.5 : 0.5)));
  const double r = (v - n) * 0.69314718055994530942;  // |r| <= 0.347
  double sum = 1.0;
  for (int k = 15; k >= 1; --k) sum = 1.0 + sum * r / k;
  const uint64_t bits = static_cast<uint64_t>(1023 + static_cast<int64_t>(n)) << 52;
  double power;
  static_assert(sizeof(power) == sizeof(bits));
  __builtin_memcpy(&power, &bits, sizeof(power));
  return sum * power;
}

// e^v for |v| < 600.
inline double ExactExp(double v) {
  return ExactExp2(v * 1.44269504088896340736);
}

// Sine and cosine of an angle in [0, 360] degrees.
inline void ExactSinCos(double angle_deg, double* sine, double* cosine) {
  const int quarter = static_cast<int>(angle_deg / 90.0 + 0.5);
  const double r = (angle_deg - 90.0 * quarter) * kRadPerDeg;  // |r| <= pi / 4
  double s = 1.0, c = 1.0;
  for (int k = 9; k >= 1; --k) s = 1.0 - s * r * r / ((2 * k) * (2 * k + 1));
  for (int k = 9; k >= 1; --k) c = 1.0 - c * r * r / ((2 * k - 1) * (2 * k));
  s *= r;
  *sine = quarter % 4 == 0 ? s : quarter % 4 == 1 ? c : quarter % 4 == 2 ? -s : -c;
  *cosine = quarter % 4 == 0 ? c : quarter % 4 == 1 ? -s : quarter % 4 == 2 ? -c : s;
}

}  // namespace veduta
