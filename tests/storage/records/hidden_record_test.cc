// SPDX-License-Identifier: Apache-2.0
// Goal: what is hidden comes back as it was stored, by key and value; one that breaks a rule is not
//   encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/hidden_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

HiddenRecord Sample() {
  return {HiddenKind::kContribution, 70'000, -5, "kai", "it shows a home"};
}

TEST(HiddenRecord, RoundTrips) {
  const HiddenRecord record = Sample();
  HiddenRecord decoded;
  ASSERT_OK(ParseHiddenKey(HiddenKey(record.kind, record.number), &decoded));
  RoundTrip(record, &decoded);
  EXPECT_EQ(decoded.kind, record.kind);
  EXPECT_EQ(decoded.number, record.number);
  EXPECT_EQ(decoded.time_unix_s, record.time_unix_s);
  EXPECT_EQ(decoded.actor, record.actor);
  EXPECT_EQ(decoded.reason, record.reason);
}

TEST(HiddenRecord, RefusesWhatBreaksARule) {
  HiddenRecord record = Sample();
  record.kind = static_cast<HiddenKind>(3);
  ExpectRefused(record, "kind");
  record = Sample();
  record.number = 0;
  ExpectRefused(record, "number");
}

TEST(HiddenRecord, DamagedKeysAreCorruption) {
  const std::string key = HiddenKey(HiddenKind::kImage, 1);
  HiddenRecord record;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseHiddenKey(key.substr(0, length), &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseHiddenKey(key + "x", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseHiddenKey(HiddenKey(HiddenKind::kImage, 0), &record).code(),
            StatusCode::kCorruption);
  EXPECT_EQ(ParseHiddenKey("state", &record).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
