// SPDX-License-Identifier: Apache-2.0
// Goal: things are parted in two so that those that contradict each other come apart and those that
//   belong together stay together; a few wrong contradictions do not change that; ties of whoever
//   contradicts nobody decide about him.
// Method: small examples by hand, and two camps of 20 with random contradictions, some of them
//   wrong.
#include "engine/mapping/two_sides.h"

#include <gtest/gtest.h>

#include <random>

namespace veduta {
namespace {

TEST(PartInTwo, NothingIsOneSide) {
  EXPECT_TRUE(PartInTwo(0, {}, {}).empty());
  EXPECT_EQ(PartInTwo(3, {}, {}), std::vector<bool>({false, false, false}));
}

TEST(PartInTwo, ContradictionsComeApartAndTiesFollow) {
  const WeightedTie contradictions[] = {{0, 1, 5}};
  const WeightedTie agreements[] = {{1, 2, 50}, {0, 3, 10}, {2, 3, 9}};
  const std::vector<bool> sides = PartInTwo(4, contradictions, agreements);
  EXPECT_NE(sides[0], sides[1]);
  EXPECT_EQ(sides[1], sides[2]);
  EXPECT_EQ(sides[0], sides[3]);
}

TEST(PartInTwo, AContradictionWeighsMoreThanAnyTie) {
  const WeightedTie contradictions[] = {{0, 1, 1}};
  const WeightedTie agreements[] = {{0, 1, 1000}};
  const std::vector<bool> sides = PartInTwo(2, contradictions, agreements);
  EXPECT_NE(sides[0], sides[1]);
}

TEST(PartInTwo, TheStrongerOfContradictionsThatCannotAllHoldDecides) {
  const WeightedTie contradictions[] = {{0, 1, 5}, {1, 2, 4}, {0, 2, 1}};
  const std::vector<bool> sides = PartInTwo(3, contradictions, {});
  EXPECT_NE(sides[0], sides[1]);
  EXPECT_NE(sides[1], sides[2]);
}

TEST(PartInTwo, TwoCampsAreFoundThroughWrongContradictions) {
  constexpr uint32_t kOfACamp = 20;
  for (uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::vector<WeightedTie> contradictions;
    for (uint32_t a = 0; a < 2 * kOfACamp; ++a) {
      for (uint32_t b = a + 1; b < 2 * kOfACamp; ++b) {
        const bool is_across = a % 2 != b % 2;
        const bool contradicts = random() % 100 < (is_across ? 40 : 3);
        if (contradicts) contradictions.push_back({a, b, 3 + static_cast<uint32_t>(random() % 5)});
      }
    }
    const std::vector<bool> sides = PartInTwo(2 * kOfACamp, contradictions, {});
    // Of whom more wrong than right ones speak, nobody can say it; what is left unsettled says it.
    uint32_t unsettled = 0, of_the_camps = 0;
    for (const WeightedTie& tie : contradictions) {
      if (sides[tie.a] == sides[tie.b]) unsettled += tie.weight;
      if (tie.a % 2 == tie.b % 2) of_the_camps += tie.weight;
    }
    EXPECT_LE(unsettled, of_the_camps) << "seed " << seed;
  }
}

}  // namespace
}  // namespace veduta
