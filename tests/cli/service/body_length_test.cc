// SPDX-License-Identifier: Apache-2.0
// Goal: a request whose body may be taken to end at several places is refused.
// Method: heads as kj parses them.
#include "cli/service/body_length.h"

#include <gtest/gtest.h>

#include <string>

namespace veduta {
namespace {

// What of a head with these headers is told to be refused; 0: nothing. `in_chunks`: as it is found.
uint32_t CodeOf(const std::string& headers, bool* in_chunks = nullptr) {
  const kj::HttpHeaderTable table;
  kj::HttpHeaders read(table);
  const std::string head = "POST / HTTP/1.1\r\n" + headers + "\r\n";
  auto text = kj::heapArray<char>(head.data(), head.size());
  EXPECT_TRUE(read.tryParseRequest(text).is<kj::HttpHeaders::Request>()) << headers;
  if (in_chunks != nullptr) *in_chunks = ComesInChunks(read);
  const auto refusal = RefuseLength(read);
  return refusal ? refusal->code : 0;
}

TEST(BodyLength, OneLengthIsTaken) {
  bool in_chunks = true;
  EXPECT_EQ(CodeOf("", &in_chunks), 0u);
  EXPECT_FALSE(in_chunks);
  EXPECT_EQ(CodeOf("Content-Length: 0\r\n"), 0u);
  EXPECT_EQ(CodeOf("Content-Length: 18446744073709551615\r\n", &in_chunks), 0u);
  EXPECT_FALSE(in_chunks);
  EXPECT_EQ(CodeOf("Transfer-Encoding: chunked\r\n", &in_chunks), 0u);
  EXPECT_TRUE(in_chunks);
}

TEST(BodyLength, TwoAreRefused) {
  EXPECT_EQ(CodeOf("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n"), 400u);
  EXPECT_EQ(CodeOf("Transfer-Encoding: chunked\r\nContent-Length: 5\r\n"), 400u);
  EXPECT_EQ(CodeOf("Transfer-Encoding : chunked\r\nContent-Length: 5\r\n"), 400u);
  EXPECT_EQ(CodeOf("Content-Length: 5\r\nContent-Length: 5\r\n"), 400u);
}

TEST(BodyLength, WhatIsNoNumberIsRefused) {
  for (const char* wrong :
       {"+5", "-5", "0x5", "5, 5", "5 5", "five", "18446744073709551616", "5\r\n 5", "\r\n 5"})
    EXPECT_EQ(CodeOf(std::string("Content-Length: ") + wrong + "\r\n"), 400u) << wrong;
}

}  // namespace
}  // namespace veduta
