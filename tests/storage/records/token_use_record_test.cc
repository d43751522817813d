// SPDX-License-Identifier: Apache-2.0
// Goal: what a token has used comes back as it was stored; one that breaks a rule is not encoded,
//   and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/token_use_record.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(TokenUseRecord, RoundTrips) {
  for (const uint32_t token : {0u, 70'000u}) {
    const TokenUse use{token, 1'700'000'000'123, 2.5, 1e12, 7, 0.5};
    TokenUse decoded;
    ASSERT_OK(ParseTokenUseKey(TokenUseKey(token), &decoded));
    RoundTrip(use, &decoded);
    EXPECT_EQ(decoded.token, token);
    EXPECT_EQ(decoded.time_unix_ms, use.time_unix_ms);
    EXPECT_EQ(decoded.photos, use.photos);
    EXPECT_EQ(decoded.bytes, use.bytes);
    EXPECT_EQ(decoded.reports, use.reports);
    EXPECT_EQ(decoded.contributions, use.contributions);
  }
}

TEST(TokenUseRecord, RefusesWhatBreaksARule) {
  for (const double wrong :
       {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    ExpectRefused(TokenUse{1, 0, wrong, 0, 0, 0}, "use");
    ExpectRefused(TokenUse{1, 0, 0, wrong, 0, 0}, "use");
    ExpectRefused(TokenUse{1, 0, 0, 0, wrong, 0}, "use");
    ExpectRefused(TokenUse{1, 0, 0, 0, 0, wrong}, "use");
  }
}

TEST(TokenUseRecord, DamagedKeysAreCorruption) {
  const std::string key = TokenUseKey(1);
  TokenUse use;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseTokenUseKey(key.substr(0, length), &use).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseTokenUseKey(key + "x", &use).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
