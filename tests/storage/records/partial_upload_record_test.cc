// SPDX-License-Identifier: Apache-2.0
// Goal: the record of a photo that arrives in parts comes back as it was stored, by key and value;
//   one that breaks a rule is not encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/partial_upload_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

PartialUploadRecord Sample() {
  PartialUploadRecord partial;
  for (size_t i = 0; i < partial.id.size(); ++i) partial.id[i] = static_cast<uint8_t>(7 * i);
  partial.name = "walk/1.jpg";
  partial.contributor = "anna";
  partial.camera = "phone";
  partial.contribution = 3;
  partial.token = 9;
  partial.length_bytes = 10'000'000'000;
  partial.received_bytes = 5'000'000'000;
  partial.piece_count = 2;
  partial.last_piece_bytes = 100;
  partial.begun_unix_s = 1'700'000'000;
  partial.touched_unix_s = 1'700'000'100;
  return partial;
}

TEST(PartialUploadRecord, RoundTrips) {
  const PartialUploadRecord partial = Sample();
  PartialUploadRecord decoded;
  ASSERT_OK(ParsePartialUploadKey(PartialUploadKey(partial.id), &decoded.id));
  EXPECT_EQ(decoded.id, partial.id);
  ASSERT_OK(ParsePartialUploadKey(PartialUploadKey(partial.id, true), &decoded.id));
  EXPECT_NE(PartialUploadKey(partial.id, true), PartialUploadKey(partial.id, false));
  RoundTrip(partial, &decoded);
  EXPECT_EQ(decoded.name, partial.name);
  EXPECT_EQ(decoded.contributor, partial.contributor);
  EXPECT_EQ(decoded.camera, partial.camera);
  EXPECT_EQ(decoded.contribution, partial.contribution);
  EXPECT_EQ(decoded.token, partial.token);
  EXPECT_EQ(decoded.length_bytes, partial.length_bytes);
  EXPECT_EQ(decoded.received_bytes, partial.received_bytes);
  EXPECT_EQ(decoded.piece_count, partial.piece_count);
  EXPECT_EQ(decoded.last_piece_bytes, partial.last_piece_bytes);
  EXPECT_EQ(decoded.begun_unix_s, partial.begun_unix_s);
  EXPECT_EQ(decoded.touched_unix_s, partial.touched_unix_s);
  EXPECT_EQ(decoded.upload, 0u);
}

TEST(PartialUploadRecord, RefusesWhatBreaksARule) {
  PartialUploadRecord partial = Sample();
  partial.received_bytes = partial.length_bytes + 1;
  ExpectRefused(partial, "received");
  partial = Sample();
  partial.length_bytes = 0;
  ExpectRefused(partial, "length");
  partial = Sample();
  partial.upload = 5;
  ExpectRefused(partial, "line");
  partial = Sample();
  partial.received_bytes = partial.length_bytes;
  ExpectRefused(partial, "line");
  partial = Sample();
  partial.piece_count = 0;
  ExpectRefused(partial, "pieces");
  partial = Sample();
  partial.last_piece_bytes = partial.received_bytes + 1;
  ExpectRefused(partial, "last piece");
  partial = Sample();
  partial.upload = 5;
  partial.received_bytes = partial.length_bytes;
  ExpectRefused(partial, "pieces");
  partial.piece_count = 0;
  partial.last_piece_bytes = 0;
  EXPECT_OK(Encode(partial));
}

TEST(PartialUploadRecord, DamageIsCorruption) {
  Fuzz(Sample());
  ExpectEveryCutIsCorruption(Sample());
  const PartialUploadRecord partial = Sample();
  PartialUploadId id{};
  uint32_t piece = 0;
  const std::string record = PartialUploadKey(partial.id), key = PieceKey(partial.id, 70'000);
  ASSERT_OK(ParsePieceKey(key, &id, &piece));
  EXPECT_EQ(id, partial.id);
  EXPECT_EQ(piece, 70'000u);
  for (size_t size = 0; size < key.size(); ++size)
    EXPECT_EQ(ParsePieceKey(key.substr(0, size), &id, &piece).code(), StatusCode::kCorruption);
  for (size_t size = 0; size < record.size(); ++size)
    EXPECT_EQ(ParsePartialUploadKey(record.substr(0, size), &id).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParsePartialUploadKey(record + "x", &id).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParsePieceKey(key + "x", &id, &piece).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParsePieceKey(record, &id, &piece).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParsePartialUploadKey(key, &id).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
