// SPDX-License-Identifier: Apache-2.0
// Goal: a request is taken for that of the address that it comes from; what stands in its head is
//   believed of named proxies alone, and no further than they go.
// Method: addresses and headers as proxies and liars write them.
#include "cli/service/remote_address.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(RemoteAddress, OneAddressIsWrittenInOneWay) {
  EXPECT_EQ(PlainAddress("192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(PlainAddress("2001:DB8:0:0::1"), "2001:db8::1");
  EXPECT_EQ(PlainAddress("::ffff:192.0.2.1"), "192.0.2.1");
  for (const char* const wrong : {"", "localhost", "192.0.2", "192.0.2.1:80", "[::1]", "1.2.3.4 "})
    EXPECT_EQ(PlainAddress(wrong), std::nullopt) << wrong;
}

TEST(RemoteAddress, NobodyIsBelievedButNamedProxies) {
  EXPECT_EQ(SenderAddress("192.0.2.1", "198.51.100.7", {}), "192.0.2.1");
  EXPECT_EQ(SenderAddress("192.0.2.1", "198.51.100.7", {"192.0.2.2"}), "192.0.2.1");
  EXPECT_EQ(SenderAddress("192.0.2.1", "", {"192.0.2.1"}), "192.0.2.1");
  EXPECT_EQ(SenderAddress("192.0.2.1", "198.51.100.7", {"192.0.2.1"}), "198.51.100.7");
}

TEST(RemoteAddress, WhatAClientWritesBeforeItsProxyIsNotRead) {
  const std::set<std::string> near = {"192.0.2.1"}, both = {"192.0.2.1", "192.0.2.2"};
  EXPECT_EQ(SenderAddress("192.0.2.1", "203.0.113.9, 198.51.100.7", near), "198.51.100.7");
  EXPECT_EQ(SenderAddress("192.0.2.1", "203.0.113.9,198.51.100.7, 192.0.2.2", both),
            "198.51.100.7");
  EXPECT_EQ(SenderAddress("192.0.2.1", "198.51.100.7, 192.0.2.2", near), "192.0.2.2");
  EXPECT_EQ(SenderAddress("192.0.2.1", "198.51.100.7, unknown", near), "192.0.2.1");
  EXPECT_EQ(SenderAddress("192.0.2.1", "192.0.2.1,192.0.2.1", near), "192.0.2.1");
}

TEST(RemoteAddress, PortsOfProxiesAreLeftOut) {
  const std::set<std::string> proxy = {"::1"};
  EXPECT_EQ(SenderAddress("::1", "198.51.100.7:4711", proxy), "198.51.100.7");
  EXPECT_EQ(SenderAddress("::1", "[2001:db8::1]:4711", proxy), "2001:db8::1");
  EXPECT_EQ(SenderAddress("::1", "2001:db8::1", proxy), "2001:db8::1");
  for (const char* const wrong : {",", "[", "]", ":", " ", "a,", "[::1"})
    EXPECT_EQ(SenderAddress("::1", wrong, proxy), "::1") << wrong;
}

TEST(RemoteAddress, ASenderHas64BitsOfVersion6) {
  EXPECT_EQ(SenderOf("2001:db8:1:2:3:4:5:6"), SenderOf("2001:db8:1:2:ffff::"));
  EXPECT_NE(SenderOf("2001:db8:1:2::1"), SenderOf("2001:db8:1:3::1"));
  EXPECT_EQ(SenderOf("192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(SenderOf(""), "");
}

TEST(RemoteAddress, ConnectionsByWhichAnybodyMayComeAreNotCounted) {
  const std::set<std::string> proxy = {"192.0.2.1"};
  for (const char* const anybody : {"127.0.0.1", "::1", "192.0.2.1", ""})
    EXPECT_EQ(CountedSender(anybody, proxy), "") << anybody;
  EXPECT_EQ(CountedSender("192.0.2.2", proxy), "192.0.2.2");
  EXPECT_EQ(CountedSender("2001:db8::1", proxy), SenderOf("2001:db8::2"));
}

}  // namespace
}  // namespace veduta
