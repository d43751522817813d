// SPDX-License-Identifier: Apache-2.0
// Goal: a pass whose time is over is asked to stop when it looks, and says so; others that ask are
//   heard at once, and are not taken for the time.
// Method: times that are over at once, or never.
#include "cli/service/pass_time.h"

#include <gtest/gtest.h>

#include <string>

namespace veduta {
namespace {

const Status kStopped = Status::Cancelled("stopped on request");

TEST(PassTime, IsOverWhenItIsLookedAt) {
  PassTime time(1e-12, {});
  EXPECT_FALSE(time.token().stop_requested()) << "the piece at hand is finished";
  time.Look();
  EXPECT_TRUE(time.token().stop_requested());
  EXPECT_NE(time.EndOf(kStopped).message().find("after 1e-12 hours"), std::string::npos);
  EXPECT_EQ(time.EndOf(kStopped).code(), StatusCode::kCancelled);
  EXPECT_TRUE(time.EndOf(Status::Ok()).ok()) << "it was done before it looked";
}

TEST(PassTime, NoneIsAsLongAsItTakes) {
  for (const double hours : {0.0, 1e5}) {
    PassTime time(hours, {});
    time.Look();
    EXPECT_FALSE(time.token().stop_requested());
  }
}

TEST(PassTime, OthersWhoAskAreHeardAtOnce) {
  std::stop_source other;
  PassTime time(1e-12, other.get_token());
  other.request_stop();
  EXPECT_TRUE(time.token().stop_requested());
  time.Look();
  EXPECT_EQ(time.EndOf(kStopped).message(), kStopped.message());
}

}  // namespace
}  // namespace veduta
