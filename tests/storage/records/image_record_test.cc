// SPDX-License-Identifier: Apache-2.0
// Goal: a stored photo's record comes back as it was stored; one that breaks a rule is not encoded,
//   and a damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/image_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(ImageRecord, RoundTrips) {
  const ImageRecord image = SampleImage(9);
  ImageRecord decoded;
  RoundTrip(image, &decoded, image.id);
  EXPECT_EQ(decoded.name, image.name);
  EXPECT_EQ(decoded.photo, image.photo);
  EXPECT_EQ(decoded.camera, image.camera);
  EXPECT_EQ(decoded.width_px, image.width_px);
  EXPECT_EQ(decoded.height_px, image.height_px);
  EXPECT_EQ(decoded.size_bytes, image.size_bytes);
  EXPECT_EQ(decoded.feature_count, image.feature_count);
  EXPECT_EQ(decoded.contributor, image.contributor);
  EXPECT_EQ(decoded.time_unix_s, image.time_unix_s);
  EXPECT_EQ(decoded.verdict, image.verdict);
  EXPECT_EQ(decoded.reason, image.reason);
  EXPECT_EQ(decoded.detail, image.detail);
  ImageRecord extreme;
  extreme.id = ImageId(kMax);
  extreme.name.assign(100'000, 'n');
  extreme.time_unix_s = std::numeric_limits<int64_t>::min();
  RoundTrip(extreme, &decoded, extreme.id);
  EXPECT_EQ(decoded.time_unix_s, extreme.time_unix_s);
  EXPECT_EQ(decoded.name, extreme.name);
}

TEST(ImageRecord, KeysOfNamesTellNameAndContributor) {
  const std::string zeros("a\0\1b\0", 5);
  const std::string texts[] = {"", "a", "ab", zeros, std::string(1, '\0'), "\xff"};
  for (const std::string& name : texts) {
    for (const std::string& contributor : texts) {
      const std::string key = NameKey(name, contributor);
      PhotoName parsed;
      ASSERT_TRUE(ParseNameKey(key, &parsed));
      EXPECT_EQ(parsed.name, name);
      EXPECT_EQ(parsed.contributor, contributor);
      for (const std::string& other : texts)
        EXPECT_EQ(key.starts_with(NamePrefix(other)), name == other);
    }
  }
  EXPECT_EQ(NameKey(std::string("a\0b", 3), "anna"), std::string("a\0\xff"
                                                                 "b\0\1anna",
                                                                 10));
  PhotoName parsed;
  for (const std::string& key :
       {std::string(), std::string("a.jpg"), std::string("a\0", 2), std::string("a\0\2anna", 7)})
    EXPECT_FALSE(ParseNameKey(key, &parsed));
}

TEST(ImageRecord, RefusesWhatBreaksARule) {
  ImageRecord image = SampleImage(1);
  image.verdict = static_cast<Verdict>(0);
  ExpectRefused(image, "verdict");
  image = SampleImage(1);
  image.reason = static_cast<Reason>(5);
  ExpectRefused(image, "reason");
}

TEST(ImageRecord, DamagedValueIsCorruption) {
  Fuzz(SampleImage(3), ImageId(3));
}

TEST(ImageRecord, KeepsWhatAnEarlierProgramLeftOut) {
  ImageRecord image = SampleImage(9), decoded;
  RoundTrip(image, &decoded, image.id);
  EXPECT_EQ(decoded.taken, std::nullopt);
  EXPECT_EQ(decoded.media_type, "");
  EXPECT_EQ(decoded.contribution, 0u);
  EXPECT_EQ(decoded.orientation, 0);
  for (const std::optional<int32_t>& offset_s : {std::optional<int32_t>(), std::optional(-3600)}) {
    image.taken = TakenTime{1'700'000'000, offset_s};
    image.media_type = "image/jpeg";
    image.contribution = 7;
    image.orientation = 8;
    RoundTrip(image, &decoded, image.id);
    EXPECT_EQ(decoded.taken, image.taken);
    EXPECT_EQ(decoded.media_type, "image/jpeg");
    EXPECT_EQ(decoded.contribution, 7u);
    EXPECT_EQ(decoded.orientation, 8);
  }
  Fuzz(image, image.id);
  image.taken->offset_s = kTakenOffsetSMax + 1;
  ExpectRefused(image, "offset");
  image.taken = TakenTime{kTakenUnixSMin - 1, std::nullopt};
  ExpectRefused(image, "time when it was taken");
  image.taken.reset();
  image.orientation = 9;
  ExpectRefused(image, "orientation");
}

}  // namespace
}  // namespace veduta
