// SPDX-License-Identifier: Apache-2.0
// Goal: what is forbidden comes back as it was stored, by key and value; one that breaks a rule is
//   not encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/forbidden_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

ForbiddenRecord Sample() {
  return {ForbiddenKind::kMerge, 3, 70000, -5, "anna", "two towers of one pattern"};
}

TEST(ForbiddenRecord, RoundTrips) {
  const ForbiddenRecord record = Sample();
  ForbiddenRecord decoded;
  ASSERT_OK(ParseForbiddenKey(ForbiddenKey(record.kind, record.a, record.b), &decoded));
  RoundTrip(record, &decoded);
  EXPECT_EQ(decoded.kind, record.kind);
  EXPECT_EQ(decoded.a, record.a);
  EXPECT_EQ(decoded.b, record.b);
  EXPECT_EQ(decoded.time_unix_s, record.time_unix_s);
  EXPECT_EQ(decoded.actor, record.actor);
  EXPECT_EQ(decoded.reason, record.reason);
}

TEST(ForbiddenRecord, RefusesWhatBreaksARule) {
  ForbiddenRecord record = Sample();
  record.kind = static_cast<ForbiddenKind>(4);
  ExpectRefused(record, "kind");
  record = Sample();
  record.a = 0;
  ExpectRefused(record, "first id");
  record = Sample();
  record.b = record.a;
  ExpectRefused(record, "second id");
  record.kind = ForbiddenKind::kPose;
  record.b = record.a + 1;
  ExpectRefused(record, "second id");
}

TEST(ForbiddenRecord, APoseIsThatOfOneImage) {
  const ForbiddenRecord record{ForbiddenKind::kPose, 300, 300, 7, "anna", "the other tower"};
  ForbiddenRecord decoded;
  ASSERT_OK(ParseForbiddenKey(ForbiddenKey(record.kind, record.a, record.b), &decoded));
  RoundTrip(record, &decoded);
  EXPECT_EQ(decoded.kind, ForbiddenKind::kPose);
  EXPECT_EQ(decoded.a, 300u);
  EXPECT_EQ(decoded.b, 300u);
}

TEST(ForbiddenRecord, DamagedKeysAreCorruption) {
  const std::string key = ForbiddenKey(ForbiddenKind::kPair, 1, 2);
  ForbiddenRecord record;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseForbiddenKey(key.substr(0, length), &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseForbiddenKey(key + "x", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseForbiddenKey("state", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseForbiddenKey(ForbiddenKey(ForbiddenKind::kPair, 2, 1), &record).code(),
            StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
