// SPDX-License-Identifier: Apache-2.0
// Goal: words and postings come back as they were stored; an array that is cut, out of order or
//   has an id 0 is refused in both directions; a generation is one run of keys.
// Method: arrays by hand; numbers around every byte boundary.
#include "storage/records/vocabulary_record.h"

#include <gtest/gtest.h>

#include "storage/records/key_bytes.h"
#include "storage/records/record_parts.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(VocabularyRecord, RawArrays) {
  std::vector<WordId> words;
  ASSERT_OK(DecodeWords(*EncodeWords(std::vector<WordId>{0, 1, kMax}), &words));
  EXPECT_EQ(words, (std::vector<WordId>{0, 1, kMax}));
  ASSERT_OK(DecodeWords("", &words));
  EXPECT_TRUE(words.empty());
  EXPECT_EQ(DecodeWords("abc", &words).code(), StatusCode::kCorruption);
  EXPECT_EQ(EncodeWords(std::vector<WordId>{1, 1}).status().code(), StatusCode::kInvalidArgument);
  std::vector<ImageId> images;
  EXPECT_EQ(DecodeImages(std::string(4, '\0'), &images).code(), StatusCode::kCorruption)
      << "image id 0";
  EXPECT_EQ(DecodeImages(EncodeU32(5) + EncodeU32(4), &images).code(), StatusCode::kCorruption)
      << "descending";
}

TEST(VocabularyRecord, PrefixBoundsItsOwnGenerationOnly) {
  const std::vector<uint32_t> numbers = {1, 255, 256, 65535, 65536, 0x7FFFFFFF, 0x80000000, kMax};
  for (const uint32_t generation : numbers) {
    const std::string prefix = VocabularyKey(generation), end = PrefixEnd(prefix);
    EXPECT_LT(prefix, end);
    for (const uint32_t word : numbers) {
      EXPECT_LT(PostingsKey(generation, word), end);
      EXPECT_GE(PostingsKey(generation, word), prefix);
      if (generation < 0xFFFFFFFF) {
        EXPECT_GE(PostingsKey(generation + 1, word), end);
      }
    }
  }
}

TEST(VocabularyRecord, KeysSortAsTheirNumbers) {
  EXPECT_LT(WordsKey(7, ImageId(255)), WordsKey(7, ImageId(256)));
  EXPECT_LT(WordsKey(7, ImageId(kMax)), WordsKey(8, ImageId(1)));
  EXPECT_LT(PostingsKey(7, 0x7FFFFFFF), PostingsKey(7, 0x80000000));
}

}  // namespace
}  // namespace veduta
