// SPDX-License-Identifier: Apache-2.0
// Goal: keys of what is sealed come back as they were, and no other key is taken for one.
// Method: round trips; keys cut, lengthened and changed.
#include "storage/records/sealed_record.h"

#include <gtest/gtest.h>

#include "storage/records/upload_record.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(SealedRecord, KeysComeBack) {
  ContentHash original, parsed;
  for (size_t i = 0; i < original.bytes.size(); ++i)
    original.bytes[i] = static_cast<uint8_t>(7 * i);
  ASSERT_TRUE(ParseSealedKey(SealedKey(original), &parsed));
  EXPECT_EQ(parsed, original);
  ImageId image;
  ASSERT_TRUE(ParseOriginalKey(OriginalKey(ImageId(70'000)), &image));
  EXPECT_EQ(image, ImageId(70'000));
  UploadEntry entry{};
  uint64_t number = 1;
  EXPECT_OK(ParseUploadKey(OriginalKey(image), &entry, &number));
  EXPECT_EQ(entry, UploadEntry::kOriginal);
  EXPECT_EQ(number, 0u);
}

TEST(SealedRecord, OtherKeysAreNone) {
  ContentHash original;
  ImageId image;
  const std::string sealed = SealedKey(original), of_image = OriginalKey(ImageId(3));
  EXPECT_FALSE(ParseSealedKey(sealed + "x", &original));
  EXPECT_FALSE(ParseSealedKey(sealed.substr(0, sealed.size() - 1), &original));
  EXPECT_FALSE(ParseSealedKey("hidden/" + sealed.substr(kSealedPrefix.size()), &original));
  EXPECT_FALSE(ParseOriginalKey(of_image + "x", &image));
  EXPECT_FALSE(ParseOriginalKey(of_image.substr(0, 4), &image));
  EXPECT_FALSE(ParseOriginalKey(OriginalPrefix() + std::string(4, '\0'), &image));
  EXPECT_FALSE(ParseOriginalKey(UploadBytesKey(3), &image));
}

}  // namespace
}  // namespace veduta
