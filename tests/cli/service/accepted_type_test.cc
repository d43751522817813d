// SPDX-License-Identifier: Apache-2.0
// Goal: the header `Accept` is read as RFC 9110 has it: the most specific range counts, with its
//   quality; what is malformed wants nothing, and breaks nothing.
// Method: headers of browsers and clients, and malformed ones, by hand.
#include "cli/service/accepted_type.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(AcceptedType, TheMostSpecificRangeCounts) {
  EXPECT_EQ(QualityOf("", "application/json"), 1);
  EXPECT_EQ(QualityOf("text/html", "application/json"), 0);
  EXPECT_EQ(
      QualityOf("*/*;q=0.1, application/*;q=0.5, application/json ; q=0.7", "application/json"),
      0.7);
  EXPECT_EQ(QualityOf("*/*;q=0.1, APPLICATION/*;Q=0.5", "application/json"), 0.5);
  EXPECT_EQ(QualityOf("*/*;q=0.1, text/*", "application/json"), 0.1);
  EXPECT_EQ(QualityOf("application/json;q=0, */*", "application/json"), 0);
}

TEST(AcceptedType, WhoPrefersAGeoPose) {
  EXPECT_TRUE(PrefersGeoPose("application/geopose+json"));
  EXPECT_TRUE(PrefersGeoPose("application/geopose+json; version=1.0, */*;q=0.8"));
  EXPECT_TRUE(PrefersGeoPose("application/json;q=0.5, application/geopose+json;q=0.6"));
  for (const char* accept :
       {"", "*/*", "application/json", "application/json, application/geopose+json",
        "application/*", "application/geopose+json;version=2.0", "text/html,*/*;q=0.8"})
    EXPECT_FALSE(PrefersGeoPose(accept)) << accept;
}

TEST(AcceptedType, WhatIsMalformedWantsNothing) {
  for (const char* accept :
       {",", ";", ",,;q=1", "application/json;q=2", "application/json;q=x", "application/json;q=-1",
        "application/json;q=nan", "/*", "application", "application/json;q="})
    EXPECT_EQ(QualityOf(accept, "application/json"), 0) << accept;
  EXPECT_EQ(QualityOf(std::string(100'000, ','), "application/json"), 0);
}

}  // namespace
}  // namespace veduta
