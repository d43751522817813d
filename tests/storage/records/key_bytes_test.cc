// SPDX-License-Identifier: Apache-2.0
// Goal: keys sort as the numbers in them do, read back, and have a smallest greater key.
// Method: numbers around every byte boundary; all pairs compared as bytes and as numbers.
#include "storage/records/key_bytes.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

const std::vector<uint32_t> kNumbers = {
    0,      1,     2,        127,      128,        255,        256,        257,
    0xFFFF, 65536, 16777215, 16777216, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF};

TEST(KeyBytes, SortAsTheirNumbers) {
  for (const uint32_t a : kNumbers) {
    for (const uint32_t b : kNumbers) {
      EXPECT_EQ(Key32(a) < Key32(b), a < b) << a << " " << b;
      EXPECT_EQ(Key32x2(a, 9) < Key32x2(b, 1), a < b);
      EXPECT_EQ(TaggedKey(1, Key32(a)) < TaggedKey(2, Key32(b)), true);
      std::string wide_a, wide_b;
      AppendBigEndian64(&wide_a, uint64_t{a} << 20);
      AppendBigEndian64(&wide_b, uint64_t{b} << 20);
      EXPECT_EQ(wide_a < wide_b, a < b);
    }
  }
}

TEST(KeyBytes, ReadBack) {
  for (const uint32_t a : kNumbers) {
    const std::string key = Key32x2(a, ~a);
    std::string_view rest = key;
    uint32_t generation = 1, word = 1;
    ASSERT_TRUE(TakeBigEndian32(&rest, &generation));
    ASSERT_TRUE(TakeBigEndian32(&rest, &word));
    EXPECT_EQ(generation, a);
    EXPECT_EQ(word, ~a);
    EXPECT_FALSE(TakeBigEndian32(&rest, &word));
    EXPECT_EQ(word, ~a) << "a failed read must not change the number";
    uint32_t id = 0;
    EXPECT_EQ(ParseId(Key32(a), &id).ok(), a != 0);
    EXPECT_FALSE(ParseId(Key32x2(a, a), &id).ok());
  }
  uint64_t wide = 0;
  std::string_view seven = "1234567";
  EXPECT_FALSE(TakeBigEndian64(&seven, &wide));
  EXPECT_EQ(seven.size(), 7u);
}

TEST(KeyBytes, PrefixEndIsAboveItsKeysOnly) {
  for (const uint32_t prefix : kNumbers) {
    const std::string end = PrefixEnd(Key32(prefix));
    for (const uint32_t rest : kNumbers) {
      EXPECT_LT(Key32x2(prefix, rest), end);
      if (prefix < kMax) {
        EXPECT_GE(Key32x2(prefix + 1, rest), end);
      }
    }
  }
}

TEST(KeyBytes, TextNamesThem) {
  EXPECT_EQ(KeyText("state"), "'state'");
  EXPECT_EQ(KeyText(Key32(0x1FF)), "0x000001ff");
}

}  // namespace
}  // namespace veduta
