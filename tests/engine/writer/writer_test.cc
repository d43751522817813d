// SPDX-License-Identifier: Apache-2.0
// Goal: one writer at a time, first come first served; reading needs no turn.
// Method: threads that queue up one after another behind a turn that is held, and then note the
//   order in which they were served; threads that each count up a number in the database by a
//   transaction of their own, where a lost update would show.
#include "engine/writer/writer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <vector>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

class WriterTest : public testing::Test {
 protected:
  void SetUp() override {
    DatabaseOptions options;
    options.create = true;
    options.sync_wal = false;
    auto opened = Database::Open(folder_.path() + "/db", options);
    ASSERT_OK(opened);
    database_ = std::move(*opened);
    writer_.emplace(database_.get());
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
  std::optional<Writer> writer_;
};

TEST_F(WriterTest, ServesInTheOrderOfAsking) {
  constexpr int kThreads = 8;
  std::vector<int> served;  // guarded by the turns
  std::vector<std::thread> threads;
  {
    const Writer::Turn held = writer_->Take();
    std::atomic<int> asking = 0;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&, i] {
        ++asking;
        const Writer::Turn turn = writer_->Take();
        served.push_back(i);
      });
      while (asking.load() <= i) std::this_thread::yield();
      // Between the count and the number that the thread draws lies one lock of a mutex.
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_TRUE(served.empty()) << "nobody is served while a turn is held";
  }
  for (std::thread& thread : threads) thread.join();
  const std::vector<int> expected = {0, 1, 2, 3, 4, 5, 6, 7};
  EXPECT_EQ(served, expected);
}

TEST_F(WriterTest, NoUpdateIsLostAndReadersDoNotWait) {
  constexpr uint32_t kThreads = 4, kTurns = 25;
  std::atomic<uint32_t> failures = 0;
  std::vector<std::thread> threads;
  for (uint32_t i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      for (uint32_t k = 0; k < kTurns; ++k) {
        Writer::Turn turn = writer_->Take();
        const auto transaction = turn.database().BeginTransaction();
        auto state = writer_->GetSnapshot()->GetState();
        if (!state.ok()) {
          ++failures;
          continue;
        }
        ++state->next_image;
        transaction->PutState(*state);
        failures += !transaction->Commit().ok();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures.load(), 0u);
  const Writer::Turn held = writer_->Take();
  const auto state = writer_->GetSnapshot()->GetState();  // while a turn is held
  ASSERT_OK(state);
  EXPECT_EQ(state->next_image, DatabaseState().next_image + kThreads * kTurns);
}

TEST_F(WriterTest, ATurnThatWasMovedEndsOnce) {
  {
    Writer::Turn first = writer_->Take();
    Writer::Turn moved = std::move(first);
    EXPECT_EQ(&moved.database(), database_.get());
  }
  const Writer::Turn next = writer_->Take();  // would wait for ever if the turn had not ended
}

}  // namespace
}  // namespace veduta
