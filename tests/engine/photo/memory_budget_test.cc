// SPDX-License-Identifier: Apache-2.0
// Goal: shares never exceed the budget, but one that is larger than all of it runs alone; whoever
//   came first is served first; what is held for convenience is given back to who waits.
// Method: threads that take random shares and count what is out; a large share among small ones.
#include "engine/photo/memory_budget.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>
#include <vector>

namespace veduta {
namespace {

TEST(MemoryBudget, SharesStayWithinItAndALargerOneIsAlone) {
  MemoryBudget budget(100);
  std::atomic<int> out = 0, holders = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 300; ++i) {
        const int bytes = (t == 0 && i % 10 == 0) ? 1000 : 1 + (i * 37 + t * 11) % 60;
        const MemoryBudget::Share share = budget.Take(bytes);
        const int others = holders++;
        const int sum = out += bytes;
        EXPECT_TRUE(bytes <= 100 || others == 0);
        EXPECT_TRUE(sum <= 100 || others == 0) << sum;
        std::this_thread::yield();
        out -= bytes;
        --holders;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(budget.HasWaiters());
  EXPECT_TRUE(budget.TryTake(100).has_value()) << "all of it has come back";
}

TEST(MemoryBudget, WhoeverCameFirstIsServedFirst) {
  MemoryBudget budget(100);
  MemoryBudget::Share first = budget.Take(60);
  std::atomic<bool> large_has_it = false;
  std::thread large([&] {
    const MemoryBudget::Share share = budget.Take(90);
    large_has_it = true;
  });
  while (!budget.HasWaiters()) std::this_thread::yield();
  EXPECT_FALSE(budget.TryTake(10).has_value()) << "it would pass the large one over";
  EXPECT_FALSE(large_has_it);
  first = {};
  large.join();
  EXPECT_TRUE(large_has_it);
}

TEST(MemoryBudget, WhoWaitsIsGivenWhatIsHeldForConvenience) {
  MemoryBudget budget(100);
  MemoryBudget::Share idle = budget.Take(50);
  const MemoryBudget::Share share = budget.Take(80, [&] { idle = {}; });
  EXPECT_FALSE(budget.TryTake(30).has_value());
  EXPECT_TRUE(budget.TryTake(20).has_value());
}

TEST(MemoryBudget, DefaultIsHalfOfWhatIsLeft) {
  constexpr uint64_t kGiB = 1ull << 30;
  EXPECT_EQ(DefaultPrepareMemoryBytes(16 * kGiB, 2 * kGiB), 7 * kGiB);
  EXPECT_EQ(DefaultPrepareMemoryBytes(kGiB, 2 * kGiB), kGiB / 4);
  EXPECT_GT(UsableMemoryBytes(), 1u << 20);
  EXPECT_LT(UsableMemoryBytes(), std::numeric_limits<uint64_t>::max());
}

}  // namespace
}  // namespace veduta
