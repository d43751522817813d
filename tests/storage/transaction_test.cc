// SPDX-License-Identifier: Apache-2.0
// Goal: a transaction's base shows the moment at which it began, and whatever another transaction
//   commits to the state between that moment and the commit is a conflict; snapshots have names
//   that grow with every commit.
// Method: two transactions interleaved in every order that matters; threads that count up.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "samples.h"
#include "storage/database.h"

namespace veduta {
namespace {

Status CommitState(Database& database, uint32_t next_image) {
  const auto transaction = database.BeginTransaction();
  transaction->PutState(SampleState(next_image));
  return transaction->Commit();
}

TEST(Transaction, BaseIsTheMomentAtWhichItBegan) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  ASSERT_OK(CommitState(*database, 5));
  const auto transaction = database->BeginTransaction();
  EXPECT_EQ(transaction->base()->GetState()->next_image, 5u);
  ASSERT_OK(CommitState(*database, 6));
  EXPECT_EQ(transaction->base()->GetState()->next_image, 5u);
  EXPECT_EQ(database->GetSnapshot()->GetState()->next_image, 6u);
}

TEST(Transaction, CommitInBetweenIsBusyAndAppliesNothing) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  const auto transaction = database->BeginTransaction();
  ASSERT_OK(CommitState(*database, 6));
  // Read only now: it is the old state all the same, and what is made of it is refused.
  DatabaseState state = *transaction->base()->GetState();
  ++state.next_image;
  transaction->PutState(state);
  transaction->PutCamera({CameraId(1), "a", {}, ""});
  EXPECT_EQ(transaction->Commit().code(), StatusCode::kBusy);
  EXPECT_EQ(database->GetSnapshot()->GetState()->next_image, 6u);
  EXPECT_TRUE(database->GetSnapshot()->ListCameras()->empty());
}

TEST(Transaction, ChangeOfTheCountsAloneIsAConflict) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  const auto first = database->BeginTransaction();
  const auto second = database->BeginTransaction();
  first->PutImage(SampleImage(1));
  second->PutImage(SampleImage(2));
  ASSERT_OK(first->Commit());
  EXPECT_EQ(second->Commit().code(), StatusCode::kBusy);
  EXPECT_EQ(database->GetSnapshot()->GetCounts()->images, 1u);
}

TEST(Transaction, BaseOutlivesTheCommitThatItWasTakenBefore) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  const std::shared_ptr<const Snapshot> base = transaction->base();
  transaction->PutState(SampleState(9));
  ASSERT_OK(transaction->Commit());
  EXPECT_EQ(base->GetState()->next_image, 1u);
  EXPECT_DEATH(transaction->base(), "after its Commit");
}

TEST(Transaction, ThreadsThatRetryWhenBusyLoseNoIncrement) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db", {.sync_wal = false});
  constexpr uint32_t kThreads = 4, kIncrements = 50;
  std::atomic<uint32_t> busy = 0;
  const auto count_up = [&] {
    for (uint32_t done = 0; done < kIncrements;) {
      const auto transaction = database->BeginTransaction();
      DatabaseState state = *transaction->base()->GetState();
      ++state.next_image;
      transaction->PutState(state);
      const Status status = transaction->Commit();
      if (status.ok()) {
        ++done;
      } else {
        ASSERT_EQ(status.code(), StatusCode::kBusy) << status.message();
        ++busy;
      }
    }
  };
  std::vector<std::thread> threads;
  for (uint32_t i = 0; i < kThreads; ++i) threads.emplace_back(count_up);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(database->GetSnapshot()->GetState()->next_image, 1 + kThreads * kIncrements);
  RecordProperty("busy", static_cast<int>(busy.load()));
}

TEST(Snapshot, NameGrowsWithEveryCommitAndOverReopening) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  uint64_t last = database->GetSnapshot()->sequence();
  EXPECT_GT(last, 0u);
  for (uint32_t i = 2; i < 12; ++i) {
    const auto before = database->GetSnapshot();
    EXPECT_EQ(before->sequence(), last) << "nothing was written since";
    ASSERT_OK(CommitState(*database, i));
    const uint64_t now = database->GetSnapshot()->sequence();
    EXPECT_GT(now, last);
    EXPECT_EQ(before->sequence(), last) << "a snapshot keeps its name";
    last = now;
  }
  database.reset();
  database = MustOpen(folder / "db", {.read_only = true});
  EXPECT_EQ(database->GetSnapshot()->sequence(), last);
  database.reset();
  database = MustOpen(folder / "db", {});
  EXPECT_GE(database->GetSnapshot()->sequence(), last);
  ASSERT_OK(CommitState(*database, 20));
  EXPECT_GT(database->GetSnapshot()->sequence(), last);
}

}  // namespace
}  // namespace veduta
