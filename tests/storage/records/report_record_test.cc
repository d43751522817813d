// SPDX-License-Identifier: Apache-2.0
// Goal: a report comes back as it was stored; one that breaks a rule is not encoded, and a damaged
//   key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/report_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

ReportRecord Sample() {
  return {7,
          ImageId(9),
          ReportReason::kPrivacy,
          "my window",
          "vera",
          1'700'000'000,
          ReportState::kHidden,
          "kai",
          1'700'000'100};
}

TEST(ReportRecord, RoundTrips) {
  const ReportRecord record = Sample();
  ReportRecord decoded;
  ASSERT_OK(ParseReportKey(ReportKey(record.number), &decoded));
  RoundTrip(record, &decoded);
  EXPECT_EQ(decoded.number, record.number);
  EXPECT_EQ(decoded.image, record.image);
  EXPECT_EQ(decoded.reason, record.reason);
  EXPECT_EQ(decoded.text, record.text);
  EXPECT_EQ(decoded.reporter, record.reporter);
  EXPECT_EQ(decoded.time_unix_s, record.time_unix_s);
  EXPECT_EQ(decoded.state, record.state);
  EXPECT_EQ(decoded.resolver, record.resolver);
  EXPECT_EQ(decoded.resolved_unix_s, record.resolved_unix_s);
}

TEST(ReportRecord, RefusesWhatBreaksARule) {
  ReportRecord record = Sample();
  record.number = 0;
  ExpectRefused(record, "number");
  record = Sample();
  record.image = ImageId();
  ExpectRefused(record, "image");
  record = Sample();
  record.reason = static_cast<ReportReason>(6);
  ExpectRefused(record, "reason");
  record = Sample();
  record.state = static_cast<ReportState>(0);
  ExpectRefused(record, "state");
  record = Sample();
  record.state = ReportState::kOpen;
  ExpectRefused(record, "resolved");
}

TEST(ReportRecord, DamagedKeysAreCorruption) {
  const std::string key = ReportKey(1);
  ReportRecord record;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseReportKey(key.substr(0, length), &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseReportKey(key + "x", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseReportKey(ReportKey(0), &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseReportKey("state", &record).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
