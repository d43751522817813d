// SPDX-License-Identifier: Apache-2.0
// Goal: the code keeps the distance that it promises in every rotation, decodes what it can,
//   and refuses the rest.
// Method: all pairs of all rotations, all patterns of errors and erasures within the budget,
//   and rings half covered in every way, exhaustively.
#include "engine/camera/markers/marker_code.h"

#include <gtest/gtest.h>

#include <bit>
#include <set>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

std::vector<uint32_t> AllRotations() {
  std::vector<uint32_t> words;
  for (MarkerId id = 0; id < kMarkerIdCount; ++id) {
    for (int i = 0; i < kMarkerBitCount; ++i) words.push_back(RotateMarkerWord(MarkerWord(id), i));
  }
  return words;
}

TEST(MarkerCode, AnyTwoRotationsDifferInSevenSectors) {
  const std::vector<uint32_t> words = AllRotations();
  EXPECT_EQ(std::set<uint32_t>(words.begin(), words.end()).size(),
            kMarkerIdCount * kMarkerBitCount);
  int distance_min = kMarkerBitCount;
  for (size_t i = 0; i < words.size(); ++i) {
    for (size_t j = 0; j < i; ++j)
      distance_min = std::min(distance_min, std::popcount(words[i] ^ words[j]));
  }
  EXPECT_EQ(distance_min, kMarkerDistanceMin);
}

TEST(MarkerCode, TheFirstIdsAreTheMostBalanced) {
  for (MarkerId id = 0; id < kMarkerIdCount; ++id) {
    const int bright = std::popcount(MarkerWord(id));
    EXPECT_EQ(bright == 11 || bright == 12, id < 112) << id;
    EXPECT_GE(bright, 7);
    EXPECT_LE(bright, 16);
  }
}

TEST(MarkerCode, ErrorsAndErasuresWithinTheBudgetAreCorrected) {
  SeededRandom random(7);
  for (int trial = 0; trial < 3000; ++trial) {
    const MarkerId id = random.Below(kMarkerIdCount);
    const int rotation = static_cast<int>(random.Below(kMarkerBitCount));
    const int errors = static_cast<int>(random.Below(4)),
              erasures = static_cast<int>(random.Below(7 - 2 * errors));
    uint32_t word = RotateMarkerWord(MarkerWord(id), rotation), known = kMarkerWordMask, wrong = 0;
    while (std::popcount(wrong) < errors) wrong |= 1u << random.Below(kMarkerBitCount);
    while (std::popcount(~known & kMarkerWordMask) < erasures) {
      const uint32_t bit = 1u << random.Below(kMarkerBitCount);
      if ((wrong & bit) == 0) known &= ~bit;
    }
    word ^= wrong | (static_cast<uint32_t>(random.Next()) & ~known &
                     kMarkerWordMask);  // erased sectors say anything
    const auto reading = DecodeMarkerWord(word, known, 6);
    ASSERT_TRUE(reading) << errors << " errors, " << erasures << " erasures";
    EXPECT_EQ(reading->id, id);
    EXPECT_EQ(reading->rotation, rotation);
    EXPECT_EQ(reading->error_count, errors);
    EXPECT_EQ(DecodeMarkerWord(word, known, 2 * errors + erasures - 1).has_value(), false);
  }
}

TEST(MarkerCode, AllDarkAndAllBrightAreNoWords) {
  EXPECT_FALSE(DecodeMarkerWord(0, kMarkerWordMask, 6));
  EXPECT_FALSE(DecodeMarkerWord(kMarkerWordMask, kMarkerWordMask, 6));
  EXPECT_FALSE(DecodeMarkerWord(0, 0, 6)) << "nothing read is nothing";
  EXPECT_FALSE(DecodeMarkerWord(MarkerWord(3), 0x7FFF, 100))
      << "more erasures than the code can bear";
}

TEST(MarkerCode, AHalfCoveredRingIsNeverAnotherId) {
  // Something dark or bright over up to 11 of 23 sectors in a row, taken for sectors: a cyclic code
  // of 11 check bits sees every such burst, so no word comes out but the ring's own.
  for (MarkerId id = 0; id < kMarkerIdCount; ++id) {
    for (int first = 0; first < kMarkerBitCount; ++first) {
      for (int length = 1; length <= 11; ++length) {
        const uint32_t cover =
            RotateMarkerWord((1u << length) - 1, (kMarkerBitCount - first) % kMarkerBitCount);
        for (const uint32_t word : {MarkerWord(id) & ~cover, MarkerWord(id) | cover}) {
          const auto reading = DecodeMarkerWord(word, kMarkerWordMask, 0);
          EXPECT_TRUE(!reading || (reading->id == id && reading->rotation == 0))
              << id << " covered at " << first;
        }
      }
    }
  }
}

}  // namespace
}  // namespace veduta
