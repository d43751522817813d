// SPDX-License-Identifier: Apache-2.0
// Goal: keys sort as the numbers in them do, prefixes bound exactly their own keys, and keys
//   read back.
// Method: numbers around every byte boundary; all pairs compared as bytes and as numbers.
#include "storage/keys.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace veduta {
namespace {

const std::vector<uint32_t> kNumbers = {
    0,      1,     2,        127,      128,        255,        256,        257,
    0xFFFF, 65536, 16777215, 16777216, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF};

TEST(Keys, SortAsTheirNumbers) {
  for (const uint32_t a : kNumbers) {
    for (const uint32_t b : kNumbers) {
      EXPECT_EQ(ImageKey(ImageId(a)) < ImageKey(ImageId(b)), a < b) << a << " " << b;
      EXPECT_EQ(WordsKey(7, ImageId(a)) < WordsKey(7, ImageId(b)), a < b);
      EXPECT_EQ(WordsKey(a, ImageId(9)) < WordsKey(b, ImageId(1)), a < b || (a == b && 9 < 1));
      EXPECT_EQ(JournalKey(uint64_t{a} << 20) < JournalKey(uint64_t{b} << 20), a < b);
      EXPECT_EQ(PointBlockKey(ReconstructionId(1), 5, ImageId(a)) <
                    PointBlockKey(ReconstructionId(1), 5, ImageId(b)),
                a < b);
    }
  }
}

TEST(Keys, ReadBack) {
  for (const uint32_t a : kNumbers) {
    const std::string key = PostingsKey(a, ~a);
    std::string_view rest = key;
    uint32_t generation = 1, word = 1;
    ASSERT_TRUE(TakeBigEndian32(&rest, &generation));
    ASSERT_TRUE(TakeBigEndian32(&rest, &word));
    EXPECT_EQ(generation, a);
    EXPECT_EQ(word, ~a);
    EXPECT_FALSE(TakeBigEndian32(&rest, &word));
    EXPECT_EQ(word, ~a) << "a failed read must not change the number";
    const std::string journal = JournalKey(uint64_t{a} << 32 | 5);
    std::string_view journal_rest = journal;
    uint64_t sequence = 0;
    ASSERT_TRUE(TakeBigEndian64(&journal_rest, &sequence));
    EXPECT_EQ(sequence, uint64_t{a} << 32 | 5);
  }
  ContentHash hash;
  for (size_t i = 0; i < hash.bytes.size(); ++i) hash.bytes[i] = static_cast<uint8_t>(251 * i);
  ContentHash read;
  ASSERT_TRUE(ParseHashKey(HashKey(hash), &read));
  EXPECT_EQ(read, hash);
  EXPECT_FALSE(ParseHashKey(HashKey(hash) + "x", &read));
  EXPECT_FALSE(ParseHashKey("", &read));
}

TEST(Keys, PrefixBoundsItsOwnKeysOnly) {
  for (const uint32_t generation : kNumbers) {
    const std::string prefix = VocabularyKey(generation), end = PrefixEnd(prefix);
    EXPECT_LT(prefix, end);
    for (const uint32_t word : kNumbers) {
      EXPECT_LT(PostingsKey(generation, word), end);
      EXPECT_GE(PostingsKey(generation, word), prefix);
      if (generation < 0xFFFFFFFF) {
        EXPECT_GE(PostingsKey(generation + 1, word), end);
      }
    }
  }
}

TEST(Keys, NeighborsAndRecordsOfPairsDoNotMix) {
  const std::string end = PrefixEnd(NeighborPrefix(ImageId(0xFFFFFFFF)));
  EXPECT_LT(NeighborKey(ImageId(0xFFFFFFFF), ImageId(0xFFFFFFFF)), end);
  EXPECT_GE(PairKey(ImageId(1), ImageId(2)), end);
}

TEST(Keys, TextNamesThem) {
  EXPECT_EQ(KeyText("state"), "'state'");
  EXPECT_EQ(KeyText(ImageKey(ImageId(0x1FF))), "0x000001ff");
}

}  // namespace
}  // namespace veduta
