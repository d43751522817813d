// SPDX-License-Identifier: Apache-2.0
// Goal: one at a time has the claim, and it comes free when its owner is done, however that ends.
// Method: claims of one thread, moved, and left by an exception; claims of several threads.
#include "engine/writer/claimable.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>
#include <vector>

namespace veduta {
namespace {

TEST(Claimable, IsClaimedOnceAtATime) {
  Claimable work;
  {
    std::optional<Claimable::Claim> first = work.TryClaim();
    ASSERT_TRUE(first);
    EXPECT_FALSE(work.TryClaim()) << "nor by the thread that has it";
    const Claimable::Claim moved = std::move(*first);
    first.reset();
    EXPECT_FALSE(work.TryClaim());
  }
  EXPECT_TRUE(work.TryClaim());
  EXPECT_TRUE(work.TryClaim());
}

TEST(Claimable, ComesFreeAfterAnException) {
  Claimable work;
  try {
    const auto claim = work.TryClaim();
    throw std::runtime_error("the work failed");
  } catch (const std::runtime_error&) {
  }
  EXPECT_TRUE(work.TryClaim());
}

TEST(Claimable, OneOfManyThreadsHasIt) {
  Claimable work;
  std::atomic<int> inside = 0, most = 0, claims = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int round = 0; round < 1000; ++round) {
        const auto claim = work.TryClaim();
        if (!claim) continue;
        ++claims;
        const int now = ++inside;
        if (now > most) most = now;
        --inside;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(claims, 1);
  EXPECT_EQ(most, 1);
}

}  // namespace
}  // namespace veduta
