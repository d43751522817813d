// SPDX-License-Identifier: Apache-2.0
// Goal: the records of a contribution and of its photos come back as they were stored, by key and
//   value; one that breaks a rule is not encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/contribution_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

ContributionRecord Sample() {
  return {70'000, "anna", "a walk\nby the river", "CC BY 4.0", 1'700'000'000, 1'700'000'100, 9};
}

ContributedPhoto SamplePhoto() {
  ContributedPhoto photo;
  photo.contribution = 70'000;
  photo.upload = 5'000'000'000;
  photo.fate = ContributionFate::kNotStored;
  photo.verdict = Verdict::kRejected;
  photo.reason = Reason::kNoTexture;
  photo.name = "1.jpg";
  return photo;
}

TEST(ContributionRecord, RoundTrips) {
  const ContributionRecord record = Sample();
  ContributionRecord decoded;
  ASSERT_OK(ParseContributionKey(ContributionKey(record.number), &decoded));
  RoundTrip(record, &decoded);
  EXPECT_EQ(decoded.number, record.number);
  EXPECT_EQ(decoded.contributor, record.contributor);
  EXPECT_EQ(decoded.comment, record.comment);
  EXPECT_EQ(decoded.licence, record.licence);
  EXPECT_EQ(decoded.opened_unix_s, record.opened_unix_s);
  EXPECT_EQ(decoded.closed_unix_s, record.closed_unix_s);
  EXPECT_EQ(decoded.photo_count, record.photo_count);
}

TEST(ContributionRecord, ItsPhotosRoundTrip) {
  const ContributedPhoto photo = SamplePhoto();
  ContributedPhoto decoded;
  ASSERT_OK(
      ParseContributedPhotoKey(ContributedPhotoKey(photo.contribution, photo.upload), &decoded));
  RoundTrip(photo, &decoded);
  EXPECT_EQ(decoded.contribution, photo.contribution);
  EXPECT_EQ(decoded.upload, photo.upload);
  EXPECT_EQ(decoded.fate, photo.fate);
  EXPECT_EQ(decoded.verdict, photo.verdict);
  EXPECT_EQ(decoded.reason, photo.reason);
  EXPECT_EQ(decoded.name, photo.name);
}

TEST(ContributionRecord, RefusesWhatBreaksARule) {
  ContributionRecord record = Sample();
  record.number = 0;
  ExpectRefused(record, "number");
  ContributedPhoto photo = SamplePhoto();
  photo.contribution = 0;
  ExpectRefused(photo, "number");
  photo = SamplePhoto();
  photo.upload = 0;
  ExpectRefused(photo, "upload");
  photo = SamplePhoto();
  photo.fate = static_cast<ContributionFate>(7);
  ExpectRefused(photo, "fate");
  photo = SamplePhoto();
  photo.image = ImageId(3);
  ExpectRefused(photo, "image");
  photo.fate = ContributionFate::kStored;
  EXPECT_OK(Encode(photo));
  photo.image = {};
  ExpectRefused(photo, "image");
  photo = SamplePhoto();
  photo.verdict = static_cast<Verdict>(9);
  ExpectRefused(photo, "verdict");
  photo = SamplePhoto();
  photo.reason = static_cast<Reason>(9);
  ExpectRefused(photo, "reason");
}

TEST(ContributionRecord, DamageIsCorruption) {
  Fuzz(Sample());
  Fuzz(SamplePhoto());
  ExpectEveryCutIsCorruption(Sample());
  ExpectEveryCutIsCorruption(SamplePhoto());
  const std::string record_key = ContributionKey(1), photo_key = ContributedPhotoKey(1, 2);
  ContributionRecord record;
  ContributedPhoto photo;
  for (size_t size = 0; size < record_key.size(); ++size)
    EXPECT_EQ(ParseContributionKey(record_key.substr(0, size), &record).code(),
              StatusCode::kCorruption);
  for (size_t size = 0; size < photo_key.size(); ++size)
    EXPECT_EQ(ParseContributedPhotoKey(photo_key.substr(0, size), &photo).code(),
              StatusCode::kCorruption);
  for (const std::string& key : {record_key + "x", ContributionKey(0), photo_key})
    EXPECT_EQ(ParseContributionKey(key, &record).code(), StatusCode::kCorruption);
  for (const std::string& key : {photo_key + "x", ContributedPhotoKey(0, 1),
                                 ContributedPhotoKey(1, 0), record_key, LastContributionKey()})
    EXPECT_EQ(ParseContributedPhotoKey(key, &photo).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
