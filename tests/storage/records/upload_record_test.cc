// SPDX-License-Identifier: Apache-2.0
// Goal: what is known of a waiting photo comes back as it was stored; a record without a number is
//   not encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; values flipped, cut, extended and replaced at seeded
//   places; keys cut and extended.
#include "storage/records/upload_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

UploadRecord Sample() {
  UploadRecord upload;
  upload.number = 7'000'000'000;
  upload.name = "IMG 1.jpg";
  upload.contributor = "anna";
  upload.camera = "phone";
  upload.photo = SampleHash(3);
  upload.size_bytes = 123'456;
  upload.time_unix_s = -5;
  return upload;
}

TEST(UploadRecord, RoundTrips) {
  const UploadRecord record = Sample();
  UploadRecord decoded;
  RoundTrip(record, &decoded, record.number);
  EXPECT_EQ(decoded.number, record.number);
  EXPECT_EQ(decoded.name, record.name);
  EXPECT_EQ(decoded.contributor, record.contributor);
  EXPECT_EQ(decoded.camera, record.camera);
  EXPECT_EQ(decoded.photo, record.photo);
  EXPECT_EQ(decoded.size_bytes, record.size_bytes);
  EXPECT_EQ(decoded.time_unix_s, record.time_unix_s);
}

TEST(UploadRecord, RefusesWhatBreaksARule) {
  UploadRecord record = Sample();
  record.number = 0;
  ExpectRefused(record, "number");
}

TEST(UploadRecord, DamagedValueIsCorruption) {
  Fuzz(Sample(), uint64_t{5});
  ExpectEveryCutIsCorruption(Sample(), uint64_t{5});
}

TEST(UploadRecord, KeysSayWhatTheyAre) {
  UploadEntry entry{};
  uint64_t number = 0;
  ASSERT_OK(ParseUploadKey(UploadKey(300), &entry, &number));
  EXPECT_EQ(entry, UploadEntry::kRecord);
  EXPECT_EQ(number, 300u);
  EXPECT_TRUE(UploadKey(300).starts_with(UploadPrefix()));
  EXPECT_LT(UploadKey(300), UploadKey(1'000));
  ASSERT_OK(ParseUploadKey(UploadBytesKey(301), &entry, &number));
  EXPECT_EQ(entry, UploadEntry::kBytes);
  EXPECT_EQ(number, 301u);
  ASSERT_OK(ParseUploadKey(LastUploadKey(), &entry, &number));
  EXPECT_EQ(entry, UploadEntry::kLastNumber);
}

TEST(UploadRecord, DamagedKeysAreCorruption) {
  UploadEntry entry{};
  uint64_t number = 0;
  const std::string key = UploadKey(5);
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseUploadKey(key.substr(0, length), &entry, &number).code(),
              StatusCode::kCorruption);
  for (const std::string& bad :
       {key + "x", UploadKey(0), LastUploadKey() + "x", std::string("\x9")})
    EXPECT_EQ(ParseUploadKey(bad, &entry, &number).code(), StatusCode::kCorruption);
}

TEST(UploadRecord, TheLastNumberComesBack) {
  uint64_t number = 0;
  ASSERT_OK(DecodeLastUpload(EncodeLastUpload(77), &number));
  EXPECT_EQ(number, 77u);
  EXPECT_EQ(DecodeLastUpload("1234567", &number).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
