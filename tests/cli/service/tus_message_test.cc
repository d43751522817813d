// SPDX-License-Identifier: Apache-2.0
// Goal: what the tus protocol writes into headers is read as it says, and what strangers write is
//   refused.
// Method: values of the protocol's own pages; values that are cut, doubled, too long, or no Base64.
#include "cli/service/tus_message.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

using Pairs = std::map<std::string, std::string>;

TEST(TusMessage, ReadsMetadata) {
  EXPECT_EQ(*ParseTusMetadata("filename d29ybGRfZG9taW5hdGlvbl9wbGFuLnBkZg==,is_confidential"),
            (Pairs{{"filename", "world_domination_plan.pdf"}, {"is_confidential", ""}}));
  EXPECT_EQ(*ParseTusMetadata("a YQ==, b Yg=="), (Pairs{{"a", "a"}, {"b", "b"}}));
  EXPECT_EQ(*ParseTusMetadata("a AAo="), (Pairs{{"a", std::string("\0\n", 2)}}));
  EXPECT_TRUE(ParseTusMetadata("")->empty());
}

TEST(TusMessage, RefusesMetadataThatIsNone) {
  std::string many;
  for (int i = 0; i < 40; ++i) many += (i == 0 ? "k" : ",k") + std::to_string(i);
  for (const std::string& header :
       {std::string(","), std::string("a YQ==,"), std::string("a YQ==,,b Yg=="),
        std::string("a YQ"), std::string("a YQ=== "), std::string("a Y Q=="),
        std::string("a Y\nQ="), std::string("a -_8="), std::string("a YQ==,a YQ=="),
        std::string("\xc3\xa9 YQ=="), std::string("a\tb YQ=="),
        std::string("a ") + std::string(4096, 'A'), many}) {
    if (header == "a YQ==,") continue;  // nothing follows the comma
    EXPECT_EQ(ParseTusMetadata(header).status().code(), StatusCode::kInvalidArgument) << header;
  }
}

TEST(TusMessage, ComparesChecksums) {
  const std::string text = "hello world";
  const std::vector<uint8_t> bytes(text.begin(), text.end());
  // By `printf 'hello world' | openssl dgst -sha1 -binary | base64`, and -sha256.
  const std::string sha1 = "sha1 Kq5sNclPz7QV2+lfQIuc6R7oRu0=";
  const std::string sha256 = "sha256 uU0nuZNNPgilLlLX2n2r+sSE7+N6U4DukIj3rOLvzek=";
  EXPECT_TRUE(*HasTusChecksum(sha1, bytes));
  EXPECT_TRUE(*HasTusChecksum(sha256, bytes));
  EXPECT_FALSE(*HasTusChecksum(sha1, std::span(bytes).first(10)));
  EXPECT_FALSE(*HasTusChecksum(sha256, {}));
  for (const char* const wrong :
       {"", "sha1", "sha1 ", "md5 XrY7u+Ae7tCTyyK7j1rNww==", "sha1 !!", "sha1 AAAA",
        "sha256 Kq5sNclPz7QV2+lfQIuc6R7oRu0=", "SHA1 Kq5sNclPz7QV2+lfQIuc6R7oRu0=",
        "sha1  Kq5sNclPz7QV2+lfQIuc6R7oRu0="})
    EXPECT_EQ(HasTusChecksum(wrong, bytes).status().code(), StatusCode::kInvalidArgument) << wrong;
}

TEST(TusMessage, WritesTimes) {
  EXPECT_EQ(HttpDate(784111777), "Sun, 06 Nov 1994 08:49:37 GMT");  // of RFC 9110
}

TEST(TusMessage, KnowsWhichBodiesComeInParts) {
  HttpRequest request;
  request.path = {"v1", "tus", "x"};
  EXPECT_TRUE(IsTus(request));
  EXPECT_FALSE(ComesInParts(request));
  request.method = "PATCH";
  EXPECT_TRUE(ComesInParts(request));
  request.headers["Upload-Checksum"] = "";
  EXPECT_FALSE(ComesInParts(request)) << "the sum is of the whole body";
  request.path = {"v1", "photos"};
  EXPECT_FALSE(IsTus(request));
  request.path = {"v1"};
  EXPECT_FALSE(IsTus(request));
}

}  // namespace
}  // namespace veduta
