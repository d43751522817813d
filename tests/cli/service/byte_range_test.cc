// SPDX-License-Identifier: Apache-2.0
// Goal: a range gives just these bytes, and what is no range gives all.
// Method: the headers of RFC 9110, section 14, on ten bytes.
#include "cli/service/byte_range.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

HttpAnswer Cut(const std::string& range, const std::string& if_range = "") {
  HttpAnswer answer{200, "image/jpeg", "0123456789", {{"ETag", "\"a\""}}};
  CutToRange(range, if_range, &answer);
  return answer;
}

TEST(ByteRange, GivesTheseBytes) {
  const std::pair<const char*, const char*> kRanges[] = {
      {"bytes=0-0", "0"},  {"bytes=2-4", "234"},        {"bytes=7-", "789"},
      {"bytes=-3", "789"}, {"bytes=-99", "0123456789"}, {"bytes=8-99999999999999999999", "89"}};
  for (const auto& [range, bytes] : kRanges) {
    const HttpAnswer answer = Cut(range);
    EXPECT_EQ(answer.code, 206u) << range;
    EXPECT_EQ(answer.body, bytes) << range;
  }
  EXPECT_EQ(HeaderOf(Cut("bytes=2-4"), "Content-Range"), "bytes 2-4/10");
  EXPECT_EQ(HeaderOf(Cut("bytes=-3"), "Content-Range"), "bytes 7-9/10");
}

TEST(ByteRange, ThereMustBeSuchBytes) {
  for (const char* range : {"bytes=10-", "bytes=10-12", "bytes=-0"}) {
    const HttpAnswer answer = Cut(range);
    EXPECT_EQ(answer.code, 416u) << range;
    EXPECT_EQ(HeaderOf(answer, "Content-Range"), "bytes */10");
  }
}

TEST(ByteRange, WhatIsNoneGivesAll) {
  for (const char* range : {"", "bytes", "bytes=", "bytes=-", "bytes=4-2", "bytes=a-b", "lines=1-2",
                            "bytes=0-1,3-4", "bytes=1 -2"}) {
    const HttpAnswer answer = Cut(range);
    EXPECT_EQ(answer.code, 200u) << range;
    EXPECT_EQ(answer.body.size(), 10u) << range;
    EXPECT_EQ(HeaderOf(answer, "Accept-Ranges"), "bytes");
  }
}

TEST(ByteRange, IsOfTheSameBytesAsBefore) {
  EXPECT_EQ(Cut("bytes=0-0", "\"a\"").code, 206u);
  EXPECT_EQ(Cut("bytes=0-0", "\"b\"").code, 200u);
  EXPECT_EQ(Cut("bytes=0-0", "W/\"a\"").code, 200u);
  HttpAnswer json = JsonAnswer(200, Json::object());
  CutToRange("bytes=0-0", "", &json);
  EXPECT_EQ(json.code, 200u);
}

}  // namespace
}  // namespace veduta
