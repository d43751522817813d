// SPDX-License-Identifier: Apache-2.0
// Goal: times are written and read as RFC 3339 has them, and nothing else is read.
// Method: known moments; texts that are cut, or wrong in each place.
#include "cli/wire/iso_time.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(IsoTime, IsUtc) {
  EXPECT_EQ(IsoTime(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(IsoTime(1'700'000'000), "2023-11-14T22:13:20Z");
  EXPECT_EQ(IsoTime(-4'544'208'000), "1826-01-01T00:00:00Z");
  EXPECT_EQ(IsoTime(-1), "1969-12-31T23:59:59Z");
}

void ExpectInterval(const char* text, std::optional<int64_t> from, std::optional<int64_t> to) {
  const auto read = ParseInterval(text);
  ASSERT_OK(read);
  EXPECT_EQ(read->from_unix_s, from) << text;
  EXPECT_EQ(read->to_unix_s, to) << text;
}

TEST(IsoTime, IntervalsMayBeOpen) {
  ExpectInterval("1970-01-01T00:00:00Z", 0, 0);
  ExpectInterval("1970-01-01t00:00:01z", 1, 1);
  ExpectInterval("1970-01-01T02:00:00+02:00/..", 0, std::nullopt);
  ExpectInterval("/1969-12-31T23:00:00-01:00", std::nullopt, 0);
  ExpectInterval("../2024-02-29T12:00:00Z", std::nullopt, 1'709'208'000);
  // Seconds that are within.
  ExpectInterval("1970-01-01T00:00:00.5Z/1970-01-01T00:00:02.5Z", 1, 2);
  ExpectInterval("1970-01-01T00:00:00.000Z/1970-01-01T00:00:02Z", 0, 2);
}

TEST(IsoTime, AnythingElseIsRefused) {
  for (const char* text :
       {"", "/", "..", "../..", "2024", "2024-01-01", "2024-01-01T00:00:00", "2024-02-30T00:00:00Z",
        "2024-01-01T24:00:00Z", "2024-01-01T00:60:00Z", "2024-01-01T00:00:61Z",
        "2024-01-01T00:00:00.Z", "2024-01-01T00:00:00+1:00", "2024-01-01T00:00:00Zx",
        "2024-01-01T00:00:00Z/2023-01-01T00:00:00Z", "2024-01-01T00:00:00Z/x",
        "2024-01-01T00:00:00Z/../..", "-024-01-01T00:00:00Z", "2024-13-01T00:00:00Z"})
    EXPECT_EQ(ParseInterval(text).status().code(), StatusCode::kInvalidArgument) << text;
}

}  // namespace
}  // namespace veduta
