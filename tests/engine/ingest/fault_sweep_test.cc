// SPDX-License-Identifier: Apache-2.0
// Goal: whichever operation of the operating system fails while photos are added, whatever was
//   acknowledged is there when the engine is opened again, the database is sound, and the same
//   command once more makes the city that an undisturbed run makes, to the last bit. A full
//   disk is named as such.
// Method: a short walk with a founding, adjustments of the whole and a vocabulary trained twice
//   runs over a faulty disk (tests/storage/fault_file_system.h) again and again, each time with
//   another operation failing; then the power is cut, or the process dies. A sample, which the
//   seeds choose; VEDUTA_SWEEP=all in the environment takes every operation.
#include <gtest/gtest.h>
#include <rocksdb/env.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "tests/engine/street_fixture.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

constexpr int kPhotoCount = 8;

CityOptions SweptOptions(uint32_t thread_count) {
  CityOptions options = City::Options(thread_count);
  options.database.sync_wal = true;  // what is acknowledged must survive the power cut
  options.ingest.schedule.views_step = 3;
  options.ingest.retrieval.compare_all_max = 3;
  options.ingest.retrieval.retrain_factor = 2;
  options.ingest.retrieval.training_count_max = 40;  // a word is a write
  return options;
}

std::vector<PhotoSubmission> SweptPhotos(City* city) {
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : Walk(6, 0.9, kPhotoCount)) photos.push_back(city->Submit(stand));
  return photos;
}

constexpr Operations kReads = Only(Operation::kRead);
constexpr Operations kNoReads = kAllOperations & ~kReads;

struct Disaster {
  Operations kinds = kNoReads;
  Fault fault = Fault::kIoError;
  uint64_t failing_count = 1;  // operations that fail, from the n-th on
  bool power_cut = true;       // else the process dies, and what it wrote stays
  uint32_t thread_count = 1;
};

class FaultSweep : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    City city(SweptOptions(1));
    const std::vector<AddOutcome> outcomes = city.Add(SweptPhotos(&city));
    EXPECT_EQ(city.Counts().placed, static_cast<uint64_t>(kPhotoCount)) << Told(outcomes);
    EXPECT_EQ(city.Counts().vocabulary_generation, 2u);
    digest_ = city.Digest();
    std::string journal;
    EXPECT_OK(city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& r) {
      return journal += r.action + " " + r.detail + "\n", true;
    }));
    for (const char* event : {"founded", "adjust", "vocabulary"}) {
      EXPECT_NE(journal.find(event), std::string::npos) << event << " did not happen: " << journal;
    }
  }

  // Those that failed; none where the n-th operation lies behind the scenario.
  static OperationCounts Survives(uint64_t n, const Disaster& disaster) {
    const auto disk = std::make_shared<FaultFileSystem>();
    CityOptions options = SweptOptions(disaster.thread_count);
    options.database.file_system = disk;
    City city(options);
    const std::vector<PhotoSubmission> photos = SweptPhotos(&city);
    disk->Fail(disaster.kinds, n, disaster.fault, disaster.failing_count);
    std::vector<AddOutcome> acknowledged;
    const Status added = city.TryAdd(photos, &acknowledged);
    const OperationCounts faults = disk->faults();
    // A step failed, and no photo. One that could not read is tried again by Settle.
    const bool is_step = !added.ok() && acknowledged.size() == photos.size();
    if (is_step && disaster.kinds == kReads) {
      disk->Heal();
      EXPECT_OK(city.engine().Settle());
      EXPECT_TRUE(IsSound(city.Ask().snapshot()));
    }
    // Some that fail need not be told: a deletion, or the mark of what was acknowledged.
    if (!added.ok()) ExpectNamed(added, disaster.fault);
    if (disk->fault_count() == 0) {
      EXPECT_OK(added);
    }
    if (disaster.power_cut) disk->CutPower();
    city.Close();
    if (!disaster.power_cut) disk->Heal();
    if (disaster.power_cut) n % 2 == 0 ? disk->DropUnsyncedData() : disk->LoseUnsyncedData(n);
    city.Open();
    if (!HasFailure()) ExpectNothingLost(&city, photos, acknowledged);
    // Photos have gone on without the step: another city than the undisturbed one.
    if (!HasFailure() && !is_step) {
      EXPECT_EQ(city.Digest(), digest_);
    }
    return faults;
  }

  static void ExpectNamed(const Status& status, Fault fault) {
    EXPECT_EQ(status.code(), StatusCode::kIoError) << status.message();
    if (fault == Fault::kNoSpace) {
      EXPECT_NE(status.message().find("disk is full"), std::string::npos) << status.message();
    }
  }

  static void ExpectNothingLost(City* city, const std::vector<PhotoSubmission>& photos,
                                const std::vector<AddOutcome>& acknowledged) {
    EXPECT_TRUE(IsSound(city->Ask().snapshot()));
    // A photo may be committed, and what follows from it then fail before it is reported.
    EXPECT_GE(city->Counts().images, acknowledged.size());
    EXPECT_LE(city->Counts().images, acknowledged.size() + 1);
    const std::vector<AddOutcome> again = city->Add(photos);
    for (size_t i = 0; i < acknowledged.size(); ++i) {
      EXPECT_TRUE(again[i].duplicate) << again[i].name << " was acknowledged and is lost";
      EXPECT_EQ(again[i].id, acknowledged[i].id);
    }
    EXPECT_TRUE(IsSound(city->Ask().snapshot()));
  }

  // The runs share nothing and go side by side; RocksDB's threads for the background must not be
  // what they wait for.
  static void Sweep(const Disaster& disaster, uint64_t stride) {
    if (std::getenv("VEDUTA_SWEEP") != nullptr) stride = 1;
    constexpr int kThreads = 3;
    rocksdb::Env::Default()->SetBackgroundThreads(kThreads, rocksdb::Env::Priority::LOW);
    rocksdb::Env::Default()->SetBackgroundThreads(kThreads, rocksdb::Env::Priority::HIGH);
    std::atomic<uint64_t> next = 0, runs = 0;
    std::array<std::atomic<uint64_t>, kOperationKinds> failed{};
    std::atomic<bool> behind = false;
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&] {
        while (!behind && !HasFailure()) {
          const uint64_t window = next++;
          const uint64_t n = window * stride + 1 + MixSeed(window, disaster.kinds) % stride;
          SCOPED_TRACE("operation " + std::to_string(n) + " failed");
          const OperationCounts faults = Survives(n, disaster);
          for (size_t kind = 0; kind < kOperationKinds; ++kind) failed[kind] += faults[kind];
          faults == OperationCounts{} ? void(behind = true) : void(++runs);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    std::cout << runs << " runs, one of each " << stride << "; operations that failed:";
    for (size_t kind = 0; kind < kOperationKinds; ++kind)
      std::cout << " " << OperationName(static_cast<Operation>(kind)) << " " << failed[kind];
    std::cout << "\n";
    // Photos that are being added are in memory mostly: there are six reads, and 140 others.
    EXPECT_GE(runs * stride, disaster.kinds == kReads ? 4u : 60u) << "it has hardly done anything";
  }

  static inline std::string digest_;
};

TEST_F(FaultSweep, AWriteFailsThenThePowerIsCut) {
  Sweep({}, 60);
}
TEST_F(FaultSweep, AWriteFailsThenTheProcessDies) {
  Sweep({.power_cut = false}, 100);
}
TEST_F(FaultSweep, AReadFailsThenTheProcessDies) {
  Sweep({.kinds = kReads, .power_cut = false}, 2);
}
TEST_F(FaultSweep, TheDiskIsFullThenTheProcessDies) {
  Sweep({.fault = Fault::kNoSpace, .failing_count = FaultFileSystem::kForever, .power_cut = false},
        100);
}
// Photos are prepared ahead here: it may be a later one's write that fails.
TEST_F(FaultSweep, TheDiskIsFullForTwoThreads) {
  Sweep({.fault = Fault::kNoSpace, .failing_count = FaultFileSystem::kForever, .thread_count = 2},
        100);
}

}  // namespace
}  // namespace veduta
