// SPDX-License-Identifier: Apache-2.0
// Goal: after a failed write the engine says so until it is opened again; opening again does not
//   wait for readers, loses nothing that was acknowledged, and adding goes on to the same city; a
//   vocabulary that was prepared before does not become active, and what is computed meanwhile is
//   not committed.
// Method: a disk that fails one write while photos are added; Questions that were asked before stay
//   held over the reopening; the end is compared with an undisturbed city.
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <thread>
#include <vector>

#include "tests/engine/street_fixture.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

TEST(Reopen, GoesOnAfterAFailedWriteWithoutWaitingForReaders) {
  const std::vector<Stand> stands = Walk(6, 0.9, 5);
  const auto disk = std::make_shared<FaultFileSystem>();
  CityOptions options = City::Options(2);
  options.database.sync_wal = true;
  options.database.file_system = disk;
  City city(options);
  const std::vector<AddOutcome> first = city.Add({stands[0], stands[1], stands[2]});
  const Questions before = city.engine().Ask();
  ASSERT_OK(before.Status());

  disk->FailWrites(1, Fault::kIoError, 1);
  std::vector<AddOutcome> outcomes;
  const Status failed = city.TryAdd({city.Submit(stands[3])}, &outcomes);
  EXPECT_EQ(failed.code(), StatusCode::kIoError) << failed.message();
  disk->Heal();
  EXPECT_EQ(city.engine().Submit(city.Submit(stands[4])).status().code(), StatusCode::kIoError)
      << "no write before the database is opened again";
  EXPECT_OK(city.engine().Ask().Status()) << "reading goes on";

  ASSERT_OK(city.engine().Reopen());
  EXPECT_EQ(before.Status().status().code(), StatusCode::kBusy) << "the files under it were closed";
  const auto status = city.engine().Ask().Status();
  ASSERT_OK(status);
  EXPECT_GE(status->images, first.size());
  const std::vector<AddOutcome> again = city.Add(stands);
  for (size_t i = 0; i < first.size(); ++i) {
    EXPECT_TRUE(again[i].duplicate);
    EXPECT_EQ(again[i].id, first[i].id);
  }
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  City undisturbed;
  undisturbed.Add(stands);
  EXPECT_EQ(city.Digest(), undisturbed.Digest());
}

// Opening again deletes what was written ahead of a vocabulary, so no commit may name it.
TEST(Reopen, AVocabularyThatWasPreparedBeforeIsNotActivated) {
  CityOptions options = City::Options(2);
  options.ingest.retrieval.training_count_max = 2000;
  City city(options);
  city.Add(Walk(6, 0.9, 3));
  EngineParts& parts = city.parts();
  const std::shared_ptr<EngineCaches> from = parts.GetCaches();
  Result<Retrieval::Prepared> prepared =
      from->retrieval.Train(parts.database.get(), parts.pool.get());
  ASSERT_OK(prepared);
  ASSERT_OK(city.engine().Reopen());
  EXPECT_EQ(parts.Activate(from, std::move(*prepared)).code(), StatusCode::kBusy);
  EXPECT_EQ(city.Counts().vocabulary_generation, 0u);
  EXPECT_OK(city.engine().TrainVocabulary());
  EXPECT_EQ(city.Counts().vocabulary_generation, 1u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

// It is computed without a turn, from a snapshot whose files are closed under it.
TEST(Reopen, ALargeAdjustmentThatRunsMeanwhileComesToNothing) {
  for (const auto pause : {std::chrono::milliseconds(0), std::chrono::milliseconds(100)}) {
    City city(City::Options(2));
    city.Add(Walk(6, 0.9, 6));
    EngineParts& parts = city.parts();
    const ReconstructionId whole = city.engine().Ask().Reconstructions()->front().id;
    const std::string before = city.Digest();
    std::optional<Result<std::optional<FollowUp>>> adjusted;
    std::thread worker;
    {
      Writer::Turn turn = parts.writer->Take();
      const long users = parts.GetCaches().use_count();
      worker = std::thread([&] { adjusted = parts.AdjustLarge(whole); });
      while (parts.GetCaches().use_count() == users) std::this_thread::yield();
      std::this_thread::sleep_for(pause);  // it computes, or waits for its turn
      EXPECT_OK(parts.Reopen(&turn));
    }
    worker.join();
    ASSERT_OK(*adjusted);
    EXPECT_FALSE((*adjusted)->has_value());
    EXPECT_EQ(city.Digest(), before);
    // It can be done anew.
    const auto again = parts.AdjustLarge(whole);
    ASSERT_OK(again);
    ASSERT_TRUE(again->has_value());
    EXPECT_OK((*again)->status);
    EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  }
}

TEST(Reopen, SnapshotsHaveNamesThatGrow) {
  City city;
  const Questions empty = city.engine().Ask();
  city.Add({{6.0, 90}});
  const Questions one = city.engine().Ask();
  EXPECT_GT(one.snapshot(), empty.snapshot());
  EXPECT_EQ(empty.Status()->images, 0u);
  EXPECT_EQ(one.Status()->snapshot, one.snapshot());
  ASSERT_OK(city.engine().Reopen());
  EXPECT_GE(city.engine().Ask().snapshot(), one.snapshot());
}

}  // namespace
}  // namespace veduta
