// SPDX-License-Identifier: Apache-2.0
// Goal: those who ask take turns, nobody waits with more than may wait, what nobody waits for any
//   more is skipped, and each task is told once what becomes of it, also when the line is closed.
// Method: one thread that the test holds, so that the order is known.
#include "cli/service/work_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <string>
#include <thread>
#include <vector>

namespace veduta {
namespace {

// A line of one thread that does nothing before it is let go.
class WorkLineTest : public testing::Test {
 protected:
  explicit WorkLineTest(const WorkLimits& limits = {.threads = 1}) : line_(limits) {
    std::promise<void> begun;
    line_.Add({"holder"}, [&begun, held = held_.get_future().share()](WorkTurn) {
      begun.set_value();
      held.wait();
    });
    begun.get_future().wait();
  }
  ~WorkLineTest() override { LetGo(); }

  void Add(WorkOwner owner, const std::string& name) {
    line_.Add(std::move(owner), [this, name](WorkTurn turn) {
      const std::lock_guard lock(mutex_);
      told_.push_back({name, turn});
      changed_.notify_all();
    });
  }
  void LetGo() {
    if (!std::exchange(is_let_go_, true)) held_.set_value();
  }
  // What was told, once so many were.
  std::vector<std::pair<std::string, WorkTurn>> Told(size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(60), [&] { return told_.size() >= count; });
    return told_;
  }
  std::string Names(size_t count) {
    std::string names;
    for (const auto& [name, turn] : Told(count)) names += name;
    return names;
  }

  std::promise<void> held_;
  bool is_let_go_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<std::string, WorkTurn>> told_;
  WorkLine line_;
};

TEST_F(WorkLineTest, ThoseWhoAskTakeTurns) {
  for (int i = 0; i < 4; ++i) Add({"anna"}, "a");
  for (int i = 0; i < 2; ++i) Add({"bela"}, "b");
  Add({"cleo"}, "c");
  LetGo();
  EXPECT_EQ(Names(7), "abcabaa");
  for (const auto& [name, turn] : told_) EXPECT_EQ(turn, WorkTurn::kCome);
}

TEST_F(WorkLineTest, WhatNobodyWaitsForIsSkipped) {
  const auto gone = std::make_shared<ClientPresence>(), here = std::make_shared<ClientPresence>();
  Add({"anna", 0, gone}, "gone");
  Add({"anna", 0, here}, "here");
  gone->Leave();
  LetGo();
  EXPECT_EQ(Told(2)[0].second, WorkTurn::kClientGone);
  EXPECT_EQ(Told(2)[1].second, WorkTurn::kCome);
}

TEST_F(WorkLineTest, AClosedLineTellsAllAtOnce) {
  for (const char* name : {"a", "b", "c"}) Add({name}, name);
  line_.Close();  // while its one thread is still at work
  Add({"d"}, "d");
  ASSERT_EQ(told_.size(), 4u);
  for (const auto& [name, turn] : told_) EXPECT_EQ(turn, WorkTurn::kClosed) << name;
}

class FullLineTest : public WorkLineTest {
 protected:
  FullLineTest()
      : WorkLineTest(
            {.threads = 1, .waiting_max = 5, .waiting_of_one_max = 3, .bytes_of_one_max = 100}) {}
  size_t CountOf(WorkTurn turn) {
    return static_cast<size_t>(
        std::ranges::count(told_, turn, &std::pair<std::string, WorkTurn>::second));
  }
};

TEST_F(FullLineTest, OneWaitsWithSoManyAndAllTogether) {
  for (int i = 0; i < 5; ++i) Add({"anna"}, "a");
  EXPECT_EQ(CountOf(WorkTurn::kFullOfOne), 2u);
  for (int i = 0; i < 2; ++i) Add({"bela"}, "b");
  EXPECT_EQ(CountOf(WorkTurn::kFull), 0u);
  Add({"cleo"}, "c");
  EXPECT_EQ(CountOf(WorkTurn::kFull), 1u);
  LetGo();
  EXPECT_EQ(Told(8).size(), 8u);
  EXPECT_EQ(CountOf(WorkTurn::kCome), 5u);
  Add({"anna"}, "a");  // there is room again
  Told(9);
  EXPECT_EQ(CountOf(WorkTurn::kCome), 6u);
}

TEST_F(FullLineTest, OneHoldsSoManyBytesButOneTaskAlways) {
  Add({"anna", 1000}, "large");
  EXPECT_EQ(told_.size(), 0u) << "it is the only one";
  Add({"anna", 1}, "small");
  EXPECT_EQ(CountOf(WorkTurn::kFullOfOne), 1u);
  Add({"bela", 60}, "first");
  Add({"bela", 40}, "second");
  EXPECT_EQ(CountOf(WorkTurn::kFullOfOne), 1u);
  Add({"bela", 1}, "third");
  EXPECT_EQ(CountOf(WorkTurn::kFullOfOne), 2u);
  LetGo();
  EXPECT_EQ(Told(5).size(), 5u);
}

TEST(WorkLine, EachTaskIsToldOnceBeforeTheLineHasGone) {
  constexpr int kCount = 2000;
  std::vector<std::atomic<int>> told(kCount);
  {
    WorkLine line({.threads = 3, .waiting_max = 100, .waiting_of_one_max = 50});
    std::vector<std::jthread> adding;
    for (int t = 0; t < 4; ++t) {
      adding.emplace_back([&, t] {
        for (int i = t; i < kCount; i += 4)
          line.Add({std::to_string(i % 5)},
                   [&told, i](WorkTurn) { ++told[static_cast<size_t>(i)]; });
      });
    }
    adding.erase(adding.begin(), adding.begin() + 2);  // the others go on while it closes
    line.Close();
    adding.clear();
  }
  for (const auto& count : told) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace veduta
