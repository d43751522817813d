// SPDX-License-Identifier: Apache-2.0
#pragma once
// The middle of a list of numbers.

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace veduta {

// The element of rank floor(n * quantile) in ascending order, n - 1 at most: with a quantile of 0.5
// the upper median. `values` must not be empty and hold no NaN; it is left in another order. O(n).
template <typename Number>
Number QuantileInPlace(std::span<Number> values, double quantile) {
  const auto rank = std::min(values.size() - 1,
                             static_cast<size_t>(static_cast<double>(values.size()) * quantile));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}
template <typename Number>
Number QuantileInPlace(std::vector<Number>& values, double quantile) {
  return QuantileInPlace(std::span<Number>(values), quantile);
}

// The upper median, element n / 2 in ascending order; `when_empty` where there is none. O(n).
template <typename Number>
Number MedianOf(std::vector<Number> values, Number when_empty = Number()) {
  return values.empty() ? when_empty : QuantileInPlace(values, 0.5);
}

}  // namespace veduta
