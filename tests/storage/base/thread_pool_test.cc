// SPDX-License-Identifier: Apache-2.0
// Goal: every piece of a loop and every task runs exactly once, whatever the number of threads,
//   also when nested.
// Method: count the runs.
#include "storage/base/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace veduta {
namespace {

TEST(ThreadPool, RunsEachIndexOnce) {
  for (const size_t threads : {0u, 1u, 3u}) {
    ThreadPool pool(threads);
    std::vector<std::atomic<int>> runs(1000);
    pool.ParallelFor(runs.size(), [&](size_t i) { ++runs[i]; });
    for (const auto& count : runs) EXPECT_EQ(count.load(), 1);
  }
}

TEST(ThreadPool, NestedLoopsFinish) {
  ThreadPool pool(2);
  std::atomic<int> runs = 0;
  pool.ParallelFor(8, [&](size_t) { pool.ParallelFor(8, [&](size_t) { ++runs; }); });
  EXPECT_EQ(runs.load(), 64);
}

TEST(ThreadPool, DestructorFinishesQueuedTasks) {
  std::atomic<int> runs = 0;
  {
    ThreadPool pool(2);
    for (int i = 0; i < 100; ++i) pool.Submit([&] { ++runs; });
  }
  EXPECT_EQ(runs.load(), 100);
}

}  // namespace
}  // namespace veduta
