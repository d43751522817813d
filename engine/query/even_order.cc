// SPDX-License-Identifier: Apache-2.0
#include "engine/query/even_order.h"

#include <numeric>

namespace veduta {
namespace {

constexpr double kGoldenSection = 0.6180339887498949;  // (sqrt(5) - 1) / 2

}  // namespace

size_t EvenStep(size_t size) {
  if (size < 3) return 1;
  const auto golden = static_cast<size_t>(kGoldenSection * static_cast<double>(size));
  for (size_t away = 0; away < golden; ++away) {
    for (const size_t step : {golden - away, golden + away})
      if (step < size && std::gcd(step, size) == 1) return step;
  }
  return 1;
}

}  // namespace veduta
