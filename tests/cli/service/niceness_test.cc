// SPDX-License-Identifier: Apache-2.0
// Goal: a thread and those that it starts become nicer than they were, and no other thread does.
// Method: a thread of its own, asked what it is by the system.
#include "cli/service/niceness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

namespace veduta {
namespace {

int Niceness() {
  return getpriority(PRIO_PROCESS, 0);
}

TEST(BeNicer, ConcernsTheThreadAndThoseThatItStarts) {
  constexpr int kMost = 19;
  const int before = Niceness();
  int own = 0, twice = 0, started = 0;
  std::thread([&] {
    BeNicer(2);
    own = Niceness();
    BeNicer(2);
    twice = Niceness();
    std::thread([&] { started = Niceness(); }).join();
  }).join();
  EXPECT_EQ(own, std::min(before + 2, kMost));
  EXPECT_EQ(twice, std::min(before + 4, kMost));
  EXPECT_EQ(started, twice);
  EXPECT_EQ(Niceness(), before);
}

}  // namespace
}  // namespace veduta
