// SPDX-License-Identifier: Apache-2.0
// Goal: whichever write, sync, renaming, deletion or read of the operating system fails, every
//   commit that was acknowledged is there afterwards, whole, and of the one that was not there is
//   all or nothing; what was written ahead and not committed is gone.
// Method: one scenario of several commits, run again and again with the n-th operation of the disk
//   failing; then the process "crashes" (reopen) or the power is cut (unsynced data dropped, all or
//   some of it, then reopen). A sample of all n, which the seeds choose; VEDUTA_SWEEP=all in the
//   environment takes every n.
#include <gtest/gtest.h>
#include <rocksdb/env.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <set>
#include <thread>

#include "fault_file_system.h"
#include "samples.h"
#include "storage/database.h"

namespace veduta {
namespace {

constexpr uint32_t kImages = 6;
constexpr uint32_t kCompactAfter =
    3;  // a compaction may run between the commits, so that its writes fail too
const std::vector<WordId> kWords = {1, 5, 9};

Status CommitImage(Database& database, uint32_t id) {
  VEDUTA_RETURN_IF_ERROR(
      database.WritePhotoAhead(SampleHash(id), SampleBytes(id, 2000 + id), SampleFeatures(id, 10)));
  auto transaction = database.BeginTransaction();
  transaction->PutImage(SampleImage(id));
  if (id > 1) transaction->PutPair(SamplePair(id - 1, id, 20));
  transaction->PutPose({ImageId(id), ReconstructionId(1), Rigid3()});
  transaction->PutPointBlock(ReconstructionId(1), 1, SampleBlock(id, 5));
  transaction->PutWords(1, ImageId(id), kWords);
  transaction->AddPostings(1, kWords, ImageId(id));
  transaction->AddJournal({id, 0, "anna", "add", ImageId(id), {}, ""});
  DatabaseState state;
  state.next_image = id + 1;
  transaction->PutState(state);
  return transaction->Commit();
}

// Commits until something fails; the number of commits that were acknowledged.
uint32_t RunScenario(const std::string& path, const DatabaseOptions& options, bool compacts,
                     const FaultFileSystem& fs) {
  auto opened = Database::Open(path, options);
  if (!opened.ok()) return 0;
  Database& database = **opened;
  uint32_t acknowledged = 0;
  for (uint32_t id = 1; id <= kImages; ++id) {
    const Status status = CommitImage(database, id);
    if (!status.ok()) {
      EXPECT_EQ(status.code(), StatusCode::kIoError) << status.message();
      // A read that failed has changed nothing.
      if (fs.faults()[static_cast<size_t>(Operation::kRead)] > 0) return acknowledged;
      // A write once failed must stay failed: what the disk holds is not known.
      EXPECT_FALSE(CommitImage(database, id + 1).ok());
      EXPECT_FALSE(CommitImage(database, id + 1).ok());
      return acknowledged;
    }
    acknowledged = id;
    if (compacts && id == kCompactAfter)
      database.Compact().IgnoreBecause("it may be what fails; the commits after it tell");
  }
  // One write-ahead that no commit follows.
  database.WritePhotoAhead(SampleHash(99), SampleBytes(99, 500), SampleFeatures(99, 3))
      .IgnoreBecause("it may be what fails");
  return acknowledged;
}

void ExpectWholeImage(const Snapshot& snapshot, uint32_t id) {
  const auto image = snapshot.GetImage(ImageId(id));
  ASSERT_OK(image);
  EXPECT_EQ(**snapshot.FindImageByName(image->name, image->contributor), ImageId(id));
  EXPECT_EQ(**snapshot.FindImageByPhoto(image->photo), ImageId(id));
  const auto photo = snapshot.GetPhoto(image->photo);
  ASSERT_OK(photo);
  EXPECT_EQ(std::vector<uint8_t>(photo->bytes().begin(), photo->bytes().end()),
            SampleBytes(id, 2000 + id));
  const auto features = snapshot.GetFeatures(image->photo);
  ASSERT_OK(features);
  EXPECT_EQ(features->size(), 10u);
  if (id > 1) {
    EXPECT_EQ(snapshot.GetPair(ImageId(id - 1), ImageId(id))->matches.size(), 20u);
  }
  EXPECT_TRUE(snapshot.FindPose(ImageId(id))->has_value());
  EXPECT_EQ(snapshot.GetPointBlock(ReconstructionId(1), 1, ImageId(id))->points.size(), 5u);
  EXPECT_EQ(*snapshot.GetWords(1, ImageId(id)), kWords);
}

// All families must tell of the same number of commits, at least `acknowledged` and at most one
// more.
void ExpectWholeCommits(const Database& database, uint32_t acknowledged) {
  const auto snapshot = database.GetSnapshot();
  const auto state = snapshot->GetState();
  ASSERT_OK(state);
  const uint32_t count = state->next_image - 1;
  EXPECT_GE(count, acknowledged);
  EXPECT_LE(count, acknowledged + 1);
  std::vector<ImageId> expected;
  std::set<ContentHash> photos;
  for (uint32_t id = 1; id <= count; ++id) {
    ExpectWholeImage(*snapshot, id);
    expected.emplace_back(id);
    photos.insert(SampleHash(id));
  }
  const auto postings = snapshot->GetPostings(1, kWords);
  ASSERT_OK(postings);
  for (const auto& images : *postings) EXPECT_EQ(images, expected);
  size_t images = 0, poses = 0, blocks = 0, entries = 0, neighbors = 0;
  EXPECT_OK(snapshot->ScanImages([&](const ImageRecord&) { return ++images, true; }));
  EXPECT_OK(snapshot->ScanPoses([&](const PoseRecord&) { return ++poses, true; }));
  EXPECT_OK(snapshot->ScanPointBlocks(ReconstructionId(1), 1,
                                      [&](const PointBlock&) { return ++blocks, true; }));
  EXPECT_OK(snapshot->ScanJournal(0, [&](const JournalRecord&) { return ++entries, true; }));
  for (uint32_t id = 1; id <= kImages + 1; ++id)
    neighbors += snapshot->ListNeighbors(ImageId(id))->size();
  EXPECT_EQ(images, count);
  EXPECT_EQ(poses, count);
  EXPECT_EQ(blocks, count);
  EXPECT_EQ(entries, count);
  EXPECT_EQ(neighbors, count == 0 ? 0 : 2 * (count - 1));
  std::set<ContentHash> stored;
  EXPECT_OK(
      snapshot->ScanPhotoKeys([&](const ContentHash& key) { return stored.insert(key).second; }));
  EXPECT_EQ(stored, photos) << "orphans must be swept";
  stored.clear();
  EXPECT_OK(
      snapshot->ScanFeatureKeys([&](const ContentHash& key) { return stored.insert(key).second; }));
  EXPECT_EQ(stored, photos);
}

struct Case {
  Operations kinds;
  Fault fault;
  uint64_t count;  // how many operations of these kinds fail from the n-th on
  bool power_cut;
  bool compacts;
  bool create;  // the failing run creates the database; otherwise it was there before
};

// An empty database to copy: creating one takes longer than everything else.
const std::string& EmptyDatabase() {
  static const TemporaryFolder folder;
  static const std::string path = [] {
    MustCreate(folder / "db").reset();
    return folder / "db";
  }();
  return path;
}

// Runs the scenario with the n-th operation failing; those that failed, none where n lies behind
// it.
OperationCounts RunCase(uint64_t n, const Case& c) {
  const TemporaryFolder folder;
  const std::string path = folder / "db";
  const auto fs = std::make_shared<FaultFileSystem>();
  DatabaseOptions options;
  options.file_system = fs;
  options.block_cache_bytes = 1 << 20;
  options.create = true;
  if (!c.create) {
    std::filesystem::copy(EmptyDatabase(), path, std::filesystem::copy_options::recursive);
    options.create = false;
  }
  fs->Fail(c.kinds, n, c.fault, c.count);
  const uint32_t acknowledged = RunScenario(path, options, c.compacts, *fs);
  const OperationCounts faults = fs->faults();
  const bool reached = fs->fault_count() > 0;
  if (c.power_cut) {
    n % 2 == 0 ? fs->DropUnsyncedData() : fs->LoseUnsyncedData(n);
  } else {
    fs->Heal();
  }
  options.create = false;
  auto database = Database::Open(path, options);
  if (c.create && acknowledged == 0 && !database.ok()) {
    // Creation was cut short: it must be possible to do it again.
    EXPECT_EQ(database.status().code(), StatusCode::kNotFound) << database.status().message();
    options.create = true;
    database = Database::Open(path, options);
  }
  EXPECT_OK(database) << "n = " << n;
  if (!database.ok()) return faults;
  ExpectWholeCommits(**database, acknowledged);
  if (!reached) {
    EXPECT_EQ(acknowledged, kImages);
  }
  // It goes on from there.
  const uint32_t next = (*database)->GetSnapshot()->GetState()->next_image;
  EXPECT_OK(CommitImage(**database, next)) << "n = " << n;
  EXPECT_EQ((*database)->GetSnapshot()->GetPostings(1, kWords)->at(0).size(), next);
  return faults;
}

// Runs one n of each `stride` until one lies behind the scenario's last operation. After a failed
// flush RocksDB sleeps a second, so the runs, which share nothing, go side by side, and so must its
// background threads.
void Sweep(const Case& c, uint64_t stride) {
  if (std::getenv("VEDUTA_SWEEP") != nullptr) stride = 1;
  EmptyDatabase();
  constexpr int kThreads = 8;
  rocksdb::Env::Default()->SetBackgroundThreads(kThreads, rocksdb::Env::Priority::LOW);
  rocksdb::Env::Default()->SetBackgroundThreads(kThreads, rocksdb::Env::Priority::HIGH);
  std::atomic<uint64_t> next = 0, runs = 0;
  std::atomic<bool> behind = false;
  std::array<std::atomic<uint64_t>, kOperationKinds> failed{};
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      while (!behind && !testing::Test::HasFailure()) {
        const uint64_t window = next++;
        const uint64_t n = window * stride + 1 + MixSeed(window, c.kinds) % stride;
        SCOPED_TRACE("operation " + std::to_string(n) + " failed");
        const OperationCounts faults = RunCase(n, c);
        uint64_t sum = 0;
        for (size_t kind = 0; kind < kOperationKinds; ++kind) {
          failed[kind] += faults[kind];
          sum += faults[kind];
        }
        sum > 0 ? void(++runs) : void(behind = true);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::cout << runs << " runs, one of each " << stride << "; operations that failed:";
  for (size_t kind = 0; kind < kOperationKinds; ++kind)
    std::cout << " " << OperationName(static_cast<Operation>(kind)) << " " << failed[kind];
  std::cout << "\n";
  EXPECT_GT(runs * stride, 40u) << "the scenario has hardly done anything";
}

constexpr uint64_t kForever = FaultFileSystem::kForever;
constexpr Operations kReads = Only(Operation::kRead);
constexpr Operations kNoReads = kAllOperations & ~kReads;

TEST(FaultSweep, OneWriteOfACommitFails) {
  Sweep({kNoReads, Fault::kIoError, 1, false, false, false}, 5);
}
TEST(FaultSweep, OneWriteOfACommitFailsThenThePowerIsCut) {
  Sweep({kNoReads, Fault::kIoError, 1, true, false, false}, 3);
}
TEST(FaultSweep, OneReadFails) {
  Sweep({kReads, Fault::kIoError, 1, false, true, false}, 30);
}
TEST(FaultSweep, ReadsFailThenThePowerIsCut) {
  Sweep({kReads, Fault::kIoError, kForever, true, true, false}, 40);
}
// Compaction writes much, and most of it alike.
TEST(FaultSweep, OneWriteFails) {
  Sweep({kNoReads, Fault::kIoError, 1, false, true, false}, 40);
}
TEST(FaultSweep, OneWriteFailsThenThePowerIsCut) {
  Sweep({kNoReads, Fault::kIoError, 1, true, true, false}, 30);
}
TEST(FaultSweep, DiskIsFullThenTheProcessDies) {
  Sweep({kNoReads, Fault::kNoSpace, kForever, false, true, false}, 40);
}
TEST(FaultSweep, DiskDiesThenThePowerIsCut) {
  Sweep({kAllOperations, Fault::kIoError, kForever, true, true, false}, 60);
}
TEST(FaultSweep, CreationFailsAndThePowerIsCut) {
  Sweep({kNoReads, Fault::kIoError, kForever, true, false, true}, 40);
}

TEST(FaultSweep, FullDiskIsNamed) {
  const TemporaryFolder folder;
  const auto fs = std::make_shared<FaultFileSystem>();
  DatabaseOptions options;
  options.file_system = fs;
  options.create = true;
  auto database = MustOpen(folder / "db", options);
  fs->FailWrites(1, Fault::kNoSpace, FaultFileSystem::kForever);
  const Status status = CommitImage(*database, 1);
  EXPECT_EQ(status.code(), StatusCode::kIoError);
  EXPECT_NE(status.message().find("disk is full"), std::string::npos) << status.message();
  fs->Heal();
  const Status later = CommitImage(*database, 1);
  EXPECT_EQ(later.code(), StatusCode::kIoError);
  EXPECT_NE(later.message().find("open the database again"), std::string::npos) << later.message();
}

}  // namespace
}  // namespace veduta
