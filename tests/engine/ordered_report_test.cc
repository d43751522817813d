// SPDX-License-Identifier: Apache-2.0
// Goal: answers are reported in order, one at a time and without a lock; an exception of the report
//   reaches who caused it, and the others are reported all the same.
// Method: answers that come in any order, from one thread, from inside of the report, and from many
//   threads.
#include "engine/ordered_report.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "storage/base/thread_pool.h"

namespace veduta {
namespace {

TEST(OrderedReport, KeepsTheOrder) {
  std::vector<int> reported;
  const std::function<void(const int&)> report = [&](const int& answer) {
    reported.push_back(answer);
  };
  OrderedReport<int> ordered(report);
  ordered.Done(2, 20);
  ordered.Done(1, 10);
  EXPECT_TRUE(reported.empty());
  ordered.Done(0, 0);
  EXPECT_EQ(reported, (std::vector{0, 10, 20}));
  ordered.Done(3, 30);
  EXPECT_EQ(reported.back(), 30);
}

// With a lock held it would wait for itself.
TEST(OrderedReport, TakesAnswersWhileItReports) {
  std::vector<int> reported;
  OrderedReport<int>* self = nullptr;
  const std::function<void(const int&)> report = [&](const int& answer) {
    reported.push_back(answer);
    if (answer == 0) {
      self->Done(2, 2);
      self->Done(1, 1);
      EXPECT_EQ(reported.size(), 1u) << "one report at a time";
    }
  };
  OrderedReport<int> ordered(report);
  self = &ordered;
  ordered.Done(0, 0);
  EXPECT_EQ(reported, (std::vector{0, 1, 2}));
}

TEST(OrderedReport, GoesOnAfterAnException) {
  std::vector<int> reported;
  const std::function<void(const int&)> report = [&](const int& answer) {
    if (answer == 0) throw std::runtime_error("no room to print");
    reported.push_back(answer);
  };
  OrderedReport<int> ordered(report);
  EXPECT_THROW(ordered.Done(0, 0), std::runtime_error);
  ordered.Done(1, 1);
  EXPECT_EQ(reported, std::vector{1});
}

TEST(OrderedReport, OfManyThreads) {
  constexpr int kCount = 500;
  std::vector<int> reported;
  std::atomic<int> inside = 0;
  const std::function<void(const int&)> report = [&](const int& answer) {
    EXPECT_EQ(++inside, 1);
    reported.push_back(answer);
    --inside;
  };
  OrderedReport<int> ordered(report);
  ThreadPool pool(3);
  pool.ParallelFor(kCount, [&](size_t i) { ordered.Done(i, static_cast<int>(i)); });
  std::vector<int> wanted(kCount);
  std::iota(wanted.begin(), wanted.end(), 0);
  EXPECT_EQ(reported, wanted);
}

}  // namespace
}  // namespace veduta
