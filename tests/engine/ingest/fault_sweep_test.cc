// SPDX-License-Identifier: Apache-2.0
// Goal: whichever write of the operating system fails while photos are added, whatever was
//   acknowledged is there when the engine is opened again, the database is sound, and the same
//   command once more makes the city that an undisturbed run makes, to the last bit. A full
//   disk is named as such.
// Method: a short walk with a founding, adjustments of the whole and a vocabulary trained twice
//   runs over a faulty disk (tests/storage/fault_file_system.h) again and again, each time with
//   another write failing; then the power is cut, or the process dies. Every stride-th write;
//   VEDUTA_FAULT_STRIDE=1 in the environment takes all of them.
#include <gtest/gtest.h>
#include <rocksdb/env.h>

#include <atomic>
#include <cstdlib>
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

struct Disaster {
  Fault fault = Fault::kIoError;
  uint64_t failing_count = 1;  // writes that fail, from the n-th on
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

  // Whether the n-th write lies within the scenario.
  static bool Survives(uint64_t n, const Disaster& disaster) {
    const auto disk = std::make_shared<FaultFileSystem>();
    CityOptions options = SweptOptions(disaster.thread_count);
    options.database.file_system = disk;
    City city(options);
    const std::vector<PhotoSubmission> photos = SweptPhotos(&city);
    disk->FailWrites(n, disaster.fault, disaster.failing_count);
    std::vector<AddOutcome> acknowledged;
    const Status added = city.TryAdd(photos, &acknowledged);
    const bool reached = disk->fault_count() > 0;
    EXPECT_EQ(added.ok(), !reached) << added.message();
    if (reached) ExpectNamed(added, disaster.fault);
    if (disaster.power_cut) disk->CutPower();
    city.Close();
    disaster.power_cut ? disk->DropUnsyncedData() : disk->Heal();
    city.Open();
    if (!HasFailure()) ExpectNothingLost(&city, photos, acknowledged);
    return reached;
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
    EXPECT_EQ(city->Digest(), digest_);
    EXPECT_TRUE(IsSound(city->Ask().snapshot()));
  }

  // The runs share nothing and go side by side; RocksDB's threads for the background must not be
  // what they wait for.
  static void Sweep(const Disaster& disaster, uint64_t stride) {
    if (const char* wanted = std::getenv("VEDUTA_FAULT_STRIDE"))
      stride = std::max(1, std::atoi(wanted));
    constexpr int kThreads = 3;
    rocksdb::Env::Default()->SetBackgroundThreads(kThreads, rocksdb::Env::Priority::LOW);
    rocksdb::Env::Default()->SetBackgroundThreads(kThreads, rocksdb::Env::Priority::HIGH);
    std::atomic<uint64_t> next = 1, faults = 0;
    std::atomic<bool> behind = false;
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&] {
        while (!behind && !HasFailure()) {
          const uint64_t n = next.fetch_add(stride);
          SCOPED_TRACE("write " + std::to_string(n) + " failed");
          Survives(n, disaster) ? void(++faults) : void(behind = true);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    std::cout << "every " << stride << ". write: " << faults << " faults injected\n";
    EXPECT_GT(faults * stride, 60u) << "the walk has hardly written anything";
  }

  static inline std::string digest_;
};

TEST_F(FaultSweep, AWriteFailsThenThePowerIsCut) {
  Sweep({}, 7);
}
TEST_F(FaultSweep, AWriteFailsThenTheProcessDies) {
  Sweep({.power_cut = false}, 31);
}
TEST_F(FaultSweep, TheDiskIsFullThenTheProcessDies) {
  Sweep({.fault = Fault::kNoSpace, .failing_count = FaultFileSystem::kForever, .power_cut = false},
        31);
}
// Photos are prepared ahead here: it may be a later one's write that fails.
TEST_F(FaultSweep, TheDiskIsFullForTwoThreads) {
  Sweep({.fault = Fault::kNoSpace, .failing_count = FaultFileSystem::kForever, .thread_count = 2},
        31);
}

}  // namespace
}  // namespace veduta
