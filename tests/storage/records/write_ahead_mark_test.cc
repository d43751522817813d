// SPDX-License-Identifier: Apache-2.0
// Goal: marks are what FORMAT.md says, byte by byte, and a photo's mark reads back.
// Method: keys written out; other marks and broken ones.
#include "storage/records/write_ahead_mark.h"

#include <gtest/gtest.h>

#include "storage/records/photo_record.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(WriteAheadMark, BytesAreThoseOfTheFormat) {
  const ContentHash photo = SampleHash(1);
  EXPECT_EQ(PhotoMarkKey(photo), std::string("\1") + HashKey(photo));
  EXPECT_EQ(PointBlocksMarkKey(ReconstructionId(0x0102), 3), std::string("\2\0\0\1\2\0\0\0\3", 9));
  EXPECT_EQ(VocabularyMarkKey(4), std::string("\3\0\0\0\4", 5));
}

TEST(WriteAheadMark, OnlyAPhotosMarkReadsAsOne) {
  const ContentHash photo = SampleHash(1);
  ContentHash read;
  ASSERT_TRUE(ParsePhotoMarkKey(PhotoMarkKey(photo), &read));
  EXPECT_EQ(read, photo);
  EXPECT_FALSE(ParsePhotoMarkKey("", &read));
  EXPECT_FALSE(ParsePhotoMarkKey("\1", &read));
  EXPECT_FALSE(ParsePhotoMarkKey(PhotoMarkKey(photo) + "x", &read));
  EXPECT_FALSE(ParsePhotoMarkKey(VocabularyMarkKey(1), &read));
}

TEST(WriteAheadMark, EachKindReadsBackAndNothingElseDoes) {
  WriteAheadMark mark;
  ASSERT_OK(ParseMarkKey(PhotoMarkKey(SampleHash(1)), &mark));
  EXPECT_EQ(mark.kind, MarkKind::kPhoto);
  EXPECT_EQ(mark.photo, SampleHash(1));
  ASSERT_OK(ParseMarkKey(PointBlocksMarkKey(ReconstructionId(5), 6), &mark));
  EXPECT_EQ(mark.kind, MarkKind::kPointBlocks);
  EXPECT_EQ(mark.reconstruction, ReconstructionId(5));
  EXPECT_EQ(mark.generation, 6u);
  ASSERT_OK(ParseMarkKey(VocabularyMarkKey(7), &mark));
  EXPECT_EQ(mark.kind, MarkKind::kVocabulary);
  EXPECT_EQ(mark.generation, 7u);
  for (const std::string& key : {std::string(), std::string("\1"), std::string("\x2xy"),
                                 VocabularyMarkKey(7) + "x", std::string("\x9xxxx")}) {
    EXPECT_EQ(ParseMarkKey(key, &mark).code(), StatusCode::kCorruption) << key;
  }
}

}  // namespace
}  // namespace veduta
