// SPDX-License-Identifier: Apache-2.0
#pragma once
// An order of a list in which each beginning is an even sample of all of it, so that whoever reads
// a long list can show it from the first part on.

#include <cstddef>
#include <vector>

namespace veduta {

// The number of steps in the list from one value of the order to the next one, round and round: the
// golden section of `size`, or the nearest number below or above that has no divisor in common with
// it, so that each value comes once. Multiples of the golden section are spread evenly for each
// count of them (Knuth, The Art of Computer Programming, volume 3, section 6.4, theorem S).
// 1 where `size` is less than 3.
size_t EvenStep(size_t size);

// O(n) time, and a second list while it runs.
template <typename T>
std::vector<T> InEvenOrder(const std::vector<T>& values) {
  std::vector<T> ordered;
  ordered.reserve(values.size());
  const size_t step = EvenStep(values.size());
  for (size_t i = 0, at = 0; i < values.size(); ++i) {
    ordered.push_back(values[at]);
    at += step;
    if (at >= values.size()) at -= values.size();
  }
  return ordered;
}

}  // namespace veduta
