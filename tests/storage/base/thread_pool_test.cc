// SPDX-License-Identifier: Apache-2.0
// Goal: every piece of a loop and every task runs exactly once, whatever the number of threads,
//   also when nested, and when some throw. A loop that threw ends as a whole first, and its caller
//   receives the exception of the lowest index.
// Method: count the runs.
#include "storage/base/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
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

TEST(ThreadPool, ALoopThatThrowsIsFinishedFirst) {
  for (const size_t threads : {0u, 1u, 3u}) {
    ThreadPool pool(threads);
    std::vector<std::atomic<int>> runs(100);
    // The lower index throws later, so that another exception is there before it.
    const auto body = [&](size_t i) {
      if (i < 4) std::this_thread::sleep_for(std::chrono::milliseconds(20 - 5 * i));
      ++runs[i];
      if (i == 1 || i == 3 || i == 70) throw std::runtime_error(std::to_string(i));
    };
    try {
      pool.ParallelFor(runs.size(), body);
      ADD_FAILURE() << "the loop threw nothing, with " << threads << " threads";
    } catch (const std::runtime_error& e) {
      EXPECT_STREQ(e.what(), "1") << threads << " threads";
    }
    for (const auto& count : runs) EXPECT_EQ(count.load(), 1) << threads << " threads";
  }
}

TEST(ThreadPool, ATaskThatThrowsEndsNoThread) {
  for (const size_t threads : {0u, 1u}) {
    std::atomic<int> runs = 0;
    {
      ThreadPool pool(threads);
      for (int i = 0; i < 3; ++i) {
        pool.Submit([&] {
          ++runs;
          throw std::bad_alloc();
        });
      }
    }
    EXPECT_EQ(runs.load(), 3);
  }
}

}  // namespace
}  // namespace veduta
