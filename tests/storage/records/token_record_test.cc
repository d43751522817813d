// SPDX-License-Identifier: Apache-2.0
// Goal: a token's record comes back as it was stored, by key and value; one that breaks a rule is
//   not encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/token_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TokenRecord Sample() {
  TokenRecord token{70'000, "anna", Role::kCurator, {}, 1'700'000'000, 1'800'000'000, 1, {5, 6, 7}};
  for (size_t i = 0; i < token.hash.size(); ++i) token.hash[i] = static_cast<uint8_t>(3 * i);
  return token;
}

TEST(TokenRecord, RoundTrips) {
  const TokenRecord token = Sample();
  TokenRecord decoded;
  ASSERT_OK(ParseTokenKey(TokenKey(token.number), &decoded));
  RoundTrip(token, &decoded);
  EXPECT_EQ(decoded.number, token.number);
  EXPECT_EQ(decoded.name, token.name);
  EXPECT_EQ(decoded.role, token.role);
  EXPECT_EQ(decoded.hash, token.hash);
  EXPECT_EQ(decoded.created_unix_s, token.created_unix_s);
  EXPECT_EQ(decoded.expires_unix_s, token.expires_unix_s);
  EXPECT_EQ(decoded.revoked_unix_s, token.revoked_unix_s);
  EXPECT_EQ(decoded.quota.photos_per_day, 5u);
  EXPECT_EQ(decoded.quota.bytes_per_day, 6u);
  EXPECT_EQ(decoded.quota.requests_per_s, 7u);
}

TEST(TokenRecord, RefusesWhatBreaksARule) {
  TokenRecord token = Sample();
  token.number = 0;
  ExpectRefused(token, "number");
  token = Sample();
  token.name.clear();
  ExpectRefused(token, "name");
  token = Sample();
  token.role = static_cast<Role>(5);
  ExpectRefused(token, "role");
  token.role = static_cast<Role>(0);
  ExpectRefused(token, "role");
  token = Sample();
  token.is_link = true;  // of a curator
  ExpectRefused(token, "role of a link");
  token.role = Role::kViewer;
  token.expires_unix_s = 0;
  ExpectRefused(token, "end of a link");
}

TEST(TokenRecord, ALinkMayShowAPart) {
  TokenRecord token = Sample(), decoded;
  token.contribution = 70'000;
  ExpectRefused(token, "a link's");
  token.role = Role::kViewer;
  token.is_link = true;
  decoded.number = token.number;
  RoundTrip(token, &decoded);
  EXPECT_EQ(decoded.contribution, token.contribution);
  token.reconstruction = 7;
  ExpectRefused(token, "1 at most");
  token.contribution = 0;
  RoundTrip(token, &decoded);
  EXPECT_EQ(decoded.reconstruction, 7u);
}

TEST(TokenRecord, KeepsThatItIsALink) {
  TokenRecord token = Sample(), decoded;
  token.role = Role::kViewer;
  token.is_link = true;
  decoded.number = token.number;
  RoundTrip(token, &decoded);
  EXPECT_TRUE(decoded.is_link);
}

TEST(TokenRecord, DamageIsCorruption) {
  Fuzz(Sample());
  ExpectEveryCutIsCorruption(Sample());
  const std::string key = TokenKey(1);
  TokenRecord token;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseTokenKey(key.substr(0, length), &token).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseTokenKey(key + "x", &token).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseTokenKey(TokenKey(0), &token).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
