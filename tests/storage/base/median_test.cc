// SPDX-License-Identifier: Apache-2.0
// Goal: medians and quantiles are the elements of the ranks that median.h names.
// Method: seeded random lists of every length to 40, with ties, against the sorted list.
#include "storage/base/median.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

std::vector<int> RandomList(size_t n, uint64_t seed) {
  SeededRandom random(seed);
  std::vector<int> values;
  for (size_t i = 0; i < n; ++i) values.push_back(static_cast<int>(random.Below(30)) - 15);
  return values;
}

TEST(Median, IsTheUpperMiddleOfTheSortedList) {
  for (size_t n = 1; n <= 40; ++n) {
    const std::vector<int> values = RandomList(n, n);
    std::vector<int> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(MedianOf(values), sorted[n / 2]) << n;
  }
}

TEST(Median, OfAPartOfAnArrayLeavesTheRestAlone) {
  int values[] = {9, 1, 5, -7};
  EXPECT_EQ(QuantileInPlace(std::span(values, 3), 0.5), 5);
  EXPECT_EQ(values[3], -7);
}

TEST(Median, OfNothingIsWhatTheCallerSays) {
  EXPECT_EQ(MedianOf(std::vector<double>(), -1.5), -1.5);
  EXPECT_EQ(MedianOf(std::vector<int>()), 0);
}

TEST(Quantile, IsTheElementOfItsRank) {
  for (size_t n = 1; n <= 40; ++n) {
    std::vector<int> sorted = RandomList(n, MixSeed(n, 1));
    std::vector<int> values = sorted;
    std::sort(sorted.begin(), sorted.end());
    for (const double quantile : {0.0, 0.1, 0.25, 0.5, 0.9, 0.99, 1.0}) {
      const size_t rank = std::min(n - 1, static_cast<size_t>(static_cast<double>(n) * quantile));
      EXPECT_EQ(QuantileInPlace(values, quantile), sorted[rank]) << n << " at " << quantile;
    }
    std::sort(values.begin(), values.end());
    EXPECT_EQ(values, sorted) << "only the order may change";
  }
}

}  // namespace
}  // namespace veduta
