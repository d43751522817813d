// SPDX-License-Identifier: Apache-2.0
// Goal: samples are of distinct matches and the same for the same seed; the number of samples is
//   the least that reaches the confidence.
// Method: many draws of every size; the formula of Fischler and Bolles turned round.
#include "engine/matching/sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

namespace veduta {
namespace {

TEST(Sampling, SamplesAreDistinctAndReachEverything) {
  for (const size_t size : {1u, 3u, 5u}) {
    for (const uint32_t n : {5u, 6u, 40u}) {
      SeededRandom random(n), again(n);
      std::vector<int> sample(size), same(size);
      std::set<int> seen;
      for (int draw = 0; draw < 2000; ++draw) {
        DrawDistinct(random, n, sample);
        DrawDistinct(again, n, same);
        EXPECT_EQ(sample, same);
        EXPECT_EQ(std::set<int>(sample.begin(), sample.end()).size(), size);
        seen.insert(sample.begin(), sample.end());
      }
      EXPECT_EQ(seen.size(), n);
      EXPECT_EQ(*seen.begin(), 0);
    }
  }
}

TEST(Sampling, TheFrontGrowsToAll) {
  for (const uint32_t n : {5u, 20u, 21u, 1000u}) {
    uint32_t before = FrontCount(n, 0, 20);
    EXPECT_EQ(before, std::min(n, 20u));
    for (uint32_t t = 1; t < 300; ++t) {
      const uint32_t count = FrontCount(n, t, 20);
      EXPECT_GE(count, before);
      EXPECT_LE(count, n);
      before = count;
    }
    EXPECT_EQ(FrontCount(n, 200, 20), n);
  }
}

TEST(Sampling, AsManySamplesAsTheConfidenceNeeds) {
  for (const double confidence : {0.5, 0.99, 0.9999}) {
    for (const double share : {0.2, 0.5, 0.9}) {
      for (const int size : {2, 3, 5}) {
        const double miss = 1 - std::pow(share, size);
        const uint32_t needed = SamplesNeeded(confidence, share, size);
        EXPECT_LE(std::pow(miss, needed), 1 - confidence + 1e-12);
        EXPECT_GT(std::pow(miss, needed - 1.0), 1 - confidence - 1e-12);
      }
    }
  }
  EXPECT_EQ(SamplesNeeded(0.99, 1.0, 5), 1u);
  EXPECT_EQ(SamplesNeeded(0.99, 0.0, 5), 1'000'000'000u);
}

TEST(Sampling, MatchesBecomeArrays) {
  const std::vector<Eigen::Vector2d> a = {{1, 2}, {3, 4}}, b = {{5, 6}, {7, 8}};
  const MatchArrays arrays(a, b);
  EXPECT_EQ(arrays.size(), 2u);
  EXPECT_EQ(arrays.ax, (std::vector<double>{1, 3}));
  EXPECT_EQ(arrays.ay, (std::vector<double>{2, 4}));
  EXPECT_EQ(arrays.bx, (std::vector<double>{5, 7}));
  EXPECT_EQ(arrays.by, (std::vector<double>{6, 8}));
}

}  // namespace
}  // namespace veduta
