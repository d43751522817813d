// SPDX-License-Identifier: Apache-2.0
// Goal: a database is opened again under the hands of readers and writers: nothing that was
//   acknowledged is lost, nobody waits for a snapshot that is held, and whatever was made before
//   says so instead of reading closed files.
// Method: snapshots, transactions and scans held over Reopen, also in other threads; the file
//   system that fails a chosen write.
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <vector>

#include "fault_file_system.h"
#include "samples.h"
#include "storage/database.h"

namespace veduta {
namespace {

constexpr uint32_t kImages = 40;

Status AddImage(Database& database, uint32_t id) {
  VEDUTA_RETURN_IF_ERROR(
      database.WritePhotoAhead(SampleHash(id), SampleBytes(id, 500), SampleFeatures(id, 3)));
  const auto transaction = database.BeginTransaction();
  DatabaseState state = *transaction->base()->GetState();
  state.next_image = id + 1;
  transaction->PutImage(SampleImage(id));
  transaction->PutState(state);
  return transaction->Commit();
}

std::unique_ptr<Database> MakeCity(const std::string& path, DatabaseOptions options = {}) {
  auto database = MustCreate(path, options);
  for (uint32_t id = 1; id <= kImages; ++id) EXPECT_OK(AddImage(*database, id));
  return database;
}

void ExpectAskAgain(const Status& status) {
  EXPECT_EQ(status.code(), StatusCode::kBusy) << status.message();
  EXPECT_NE(status.message().find("was opened again: ask again"), std::string::npos)
      << status.message();
}

uint32_t CountImages(const Snapshot& snapshot) {
  uint32_t count = 0;
  EXPECT_OK(snapshot.ScanImages([&](const ImageRecord&) { return ++count, true; }));
  return count;
}

TEST(Reopen, EveryUseOfAnOldSnapshotSaysWhatToDo) {
  const TemporaryFolder folder;
  const auto database = MakeCity(folder / "db");
  const auto held = database->GetSnapshot();
  const auto photo = held->GetPhoto(SampleHash(3));
  ASSERT_OK(database->Reopen());
  ExpectAskAgain(held->GetState().status());
  ExpectAskAgain(held->GetCounts().status());
  ExpectAskAgain(held->GetImage(ImageId(1)).status());
  ExpectAskAgain(held->GetPhoto(SampleHash(1)).status());
  ExpectAskAgain(held->GetPostings(1, std::vector<WordId>{1}).status());
  ExpectAskAgain(held->ScanImages([](const ImageRecord&) { return true; }));
  ExpectAskAgain(held->ScanPhotoKeys([](const ContentHash&) { return true; }));
  ExpectAskAgain(held->dense().ListSettings().status());
  ExpectAskAgain(held->dense().FindDepth(ImageId(1)).status());
  EXPECT_EQ(photo->bytes().size(), 500u) << "a result owns what it holds";
  const auto fresh = database->GetSnapshot();
  EXPECT_EQ(CountImages(*fresh), kImages);
  EXPECT_GE(fresh->sequence(), held->sequence());
  EXPECT_EQ(fresh->GetPhoto(SampleHash(3))->bytes().size(), 500u);
}

TEST(Reopen, OldTransactionIsRefusedAndANewOneWorks) {
  const TemporaryFolder folder;
  const auto database = MakeCity(folder / "db");
  const auto begun = database->BeginTransaction();
  begun->PutImage(SampleImage(100));
  const auto untouched = database->BeginTransaction();
  ASSERT_OK(database->Reopen());
  begun->PutCamera({CameraId(1), "late", {}, ""});
  begun->AddPostings(1, std::vector<WordId>{1, 2}, ImageId(1));
  begun->DeleteVocabulary(7);
  ExpectAskAgain(begun->base()->GetState().status());
  ExpectAskAgain(begun->Commit());
  ExpectAskAgain(untouched->Commit());
  EXPECT_EQ(CountImages(*database->GetSnapshot()), kImages);
  EXPECT_OK(AddImage(*database, kImages + 1));
  EXPECT_EQ(database->GetSnapshot()->GetCounts()->images, kImages + 1);
}

TEST(Reopen, ScanOfAnotherThreadEndsAtItsNextRecord) {
  const TemporaryFolder folder;
  const auto database = MakeCity(folder / "db");
  std::promise<void> in_the_middle, reopened;
  std::atomic<uint32_t> seen = 0;
  Status status;
  std::thread reader([&] {
    const auto snapshot = database->GetSnapshot();
    status = snapshot->ScanImages([&](const ImageRecord&) {
      if (++seen == 10) {
        in_the_middle.set_value();
        reopened.get_future().wait();  // however long the reader takes, Reopen does not wait
      }
      return true;
    });
  });
  in_the_middle.get_future().wait();
  ASSERT_OK(database->Reopen());
  EXPECT_EQ(CountImages(*database->GetSnapshot()), kImages);
  reopened.set_value();
  reader.join();
  EXPECT_EQ(seen.load(), 10u);
  ExpectAskAgain(status);
}

TEST(Reopen, ReadersInAllThreadsSeeWholeStatesOrTheError) {
  const TemporaryFolder folder;
  const auto database = MakeCity(folder / "db", {.sync_wal = false});
  std::atomic<bool> stop = false;
  std::atomic<uint32_t> refused = 0, whole = 0;
  std::vector<std::thread> readers;
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&] {
      while (!stop) {
        const auto snapshot = database->GetSnapshot();
        uint32_t count = 0;
        const Status status = snapshot->ScanImages([&](const ImageRecord& image) {
          const auto photo = snapshot->GetPhoto(image.photo);  // a read inside a scan
          if (!photo.ok()) return false;
          EXPECT_EQ(photo->bytes().size(), 500u);
          return ++count, true;
        });
        if (status.ok() && count == kImages) {
          ++whole;
        } else {
          if (!status.ok()) ExpectAskAgain(status);
          ++refused;
        }
      }
    });
  }
  for (int i = 0; i < 20; ++i) EXPECT_OK(database->Reopen());
  while (whole == 0) std::this_thread::yield();
  stop = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(CountImages(*database->GetSnapshot()), kImages);
  RecordProperty("refused", static_cast<int>(refused.load()));
}

TEST(Reopen, AfterAFailedWriteAllThatWasAcknowledgedIsThere) {
  for (uint64_t n = 1; n <= 12; ++n) {
    const TemporaryFolder folder;
    const auto fs = std::make_shared<FaultFileSystem>();
    const auto database = MakeCity(folder / "db", {.file_system = fs});
    const auto held = database->GetSnapshot();
    fs->FailWrites(n, Fault::kIoError, 1);
    uint32_t acknowledged = kImages;
    Status failed;
    for (uint32_t id = kImages + 1; failed.ok() && id <= kImages + 20; ++id) {
      failed = AddImage(*database, id);
      if (failed.ok()) acknowledged = id;
    }
    ASSERT_EQ(failed.code(), StatusCode::kIoError) << "write " << n;
    EXPECT_FALSE(AddImage(*database, 200).ok()) << "refused until it is opened again";
    EXPECT_EQ(CountImages(*held), kImages) << "readers are not disturbed by a failed write";
    ASSERT_OK(database->Reopen());
    ExpectAskAgain(held->GetState().status());
    const auto snapshot = database->GetSnapshot();
    const uint32_t count = CountImages(*snapshot);
    EXPECT_GE(count, acknowledged) << "write " << n;
    EXPECT_LE(count, acknowledged + 1) << "write " << n;
    EXPECT_EQ(snapshot->GetState()->next_image, count + 1);
    EXPECT_EQ(snapshot->GetCounts()->images, count);
    for (uint32_t id = 1; id <= count; ++id) EXPECT_OK(snapshot->GetPhoto(SampleHash(id)));
    EXPECT_OK(AddImage(*database, count + 1));
  }
}

// A flush may fail to sync the log although every write of ours succeeded. Closing must not sync
// the log again then.
TEST(Reopen, AfterAFailedCompactionAllIsThere) {
  uint64_t failed_syncs = 0;
  for (uint64_t n = 1; n <= 4; ++n) {
    const TemporaryFolder folder;
    const auto fs = std::make_shared<FaultFileSystem>();
    const auto database = MakeCity(folder / "db", {.file_system = fs});
    // Not synced: a flush syncs the log that holds it.
    ASSERT_OK(database->WritePhotoAhead(SampleHash(99), SampleBytes(9, 9), SampleFeatures(9, 2)));
    fs->FailWrites(n, Fault::kIoError, FaultFileSystem::kForever);
    EXPECT_EQ(database->Compact().code(), StatusCode::kIoError) << "write " << n;
    failed_syncs += fs->faults()[static_cast<size_t>(Operation::kSync)];
    fs->Heal();
    ASSERT_OK(database->Reopen());
    EXPECT_EQ(CountImages(*database->GetSnapshot()), kImages) << "write " << n;
    EXPECT_OK(AddImage(*database, kImages + 1));
  }
  EXPECT_GT(failed_syncs, 0u);
}

TEST(Reopen, PhotosWrittenAheadStayAndGenerationsGo) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  ASSERT_OK(database->WritePhotoAhead(SampleHash(1), SampleBytes(1, 10), SampleFeatures(1, 2)));
  ASSERT_OK(database->WritePhotoAhead(SampleHash(2), SampleBytes(2, 10), SampleFeatures(2, 2)));
  ASSERT_OK(database->WriteVocabularyAhead(1, SampleBytes(9, 100)));
  ASSERT_OK(database->Reopen());
  auto snapshot = database->GetSnapshot();
  EXPECT_OK(snapshot->GetPhoto(SampleHash(1)));
  EXPECT_TRUE(*snapshot->IsWrittenAhead(SampleHash(2)));
  EXPECT_EQ(snapshot->GetVocabulary(1).status().code(), StatusCode::kNotFound);
  ASSERT_OK(database->DropPhotoAhead(SampleHash(2)));
  const auto transaction = database->BeginTransaction();
  transaction->PutImage(SampleImage(1));
  ASSERT_OK(transaction->Commit());
  snapshot = database->GetSnapshot();
  EXPECT_EQ(snapshot->GetPhoto(SampleHash(2)).status().code(), StatusCode::kNotFound);
  EXPECT_OK(snapshot->GetPhoto(SampleHash(1)));
}

// What was written without a sync may be gone when the power is cut; the log's end says so.
TEST(Reopen, PhotoThatTheDiskLostIsNeverNamedByARecord) {
  const TemporaryFolder folder;
  const auto fs = std::make_shared<FaultFileSystem>();
  const auto database = MustCreate(folder / "db", {.file_system = fs});
  ASSERT_OK(database->WritePhotoAhead(SampleHash(1), SampleBytes(1, 10), SampleFeatures(1, 2)));
  fs->FailWrites(1, Fault::kIoError, FaultFileSystem::kForever);
  EXPECT_FALSE(AddImage(*database, 2).ok());
  EXPECT_FALSE(database->Reopen().ok()) << "the disk is still broken";
  fs->DropUnsyncedData();
  ASSERT_OK(database->Reopen());
  EXPECT_EQ(database->GetSnapshot()->GetPhoto(SampleHash(1)).status().code(),
            StatusCode::kNotFound);
  const auto transaction = database->BeginTransaction();
  transaction->PutImage(SampleImage(1));
  const Status lost = transaction->Commit();
  EXPECT_EQ(lost.code(), StatusCode::kIoError);
  EXPECT_NE(lost.message().find("was lost"), std::string::npos) << lost.message();
  EXPECT_OK(AddImage(*database, 1)) << "written ahead again";
}

// A photo and its features are two records of the log.
TEST(Reopen, PhotoWithoutItsFeaturesIsNoPhoto) {
  uint32_t halves = 0;
  for (uint64_t n = 1;; ++n) {
    const TemporaryFolder folder;
    const auto fs = std::make_shared<FaultFileSystem>();
    const auto database = MustCreate(folder / "db", {.file_system = fs});
    fs->FailWrites(n, Fault::kIoError, FaultFileSystem::kForever);
    const bool written =
        database->WritePhotoAhead(SampleHash(1), SampleBytes(1, 10), SampleFeatures(1, 2)).ok();
    if (written) break;
    const auto snapshot = database->GetSnapshot();
    halves += snapshot->GetPhoto(SampleHash(1)).ok() && !snapshot->GetFeatures(SampleHash(1)).ok();
    fs->Heal();
    ASSERT_OK(database->Reopen());
    EXPECT_EQ(database->GetSnapshot()->GetPhoto(SampleHash(1)).status().code(),
              StatusCode::kNotFound)
        << "write " << n;
    EXPECT_FALSE(*database->GetSnapshot()->IsWrittenAhead(SampleHash(1)));
    EXPECT_OK(AddImage(*database, 1));
  }
  EXPECT_GT(halves, 0u);
}

TEST(Reopen, WhereItFailsTheReasonIsGivenUntilItWorks) {
  const TemporaryFolder folder;
  const auto fs = std::make_shared<FaultFileSystem>();
  const auto database = MakeCity(folder / "db", {.file_system = fs});
  const auto held = database->GetSnapshot();
  fs->FailWrites(1, Fault::kNoSpace, FaultFileSystem::kForever);
  const Status failed = database->Reopen();
  EXPECT_EQ(failed.code(), StatusCode::kIoError);
  EXPECT_NE(failed.message().find("disk is full"), std::string::npos) << failed.message();
  for (const auto& snapshot : {held, database->GetSnapshot()}) {
    const Status status = snapshot->GetState().status();
    EXPECT_EQ(status.code(), StatusCode::kBusy);
    EXPECT_NE(status.message().find("could not be opened again"), std::string::npos)
        << status.message();
  }
  EXPECT_EQ(AddImage(*database, 99).code(), StatusCode::kBusy);
  fs->Heal();
  ASSERT_OK(database->Reopen());
  EXPECT_EQ(CountImages(*database->GetSnapshot()), kImages);
}

TEST(Reopen, ReaderSeesWhatAnotherProcessHasWritten) {
  const TemporaryFolder folder;
  const auto writer = MakeCity(folder / "db");
  const auto reader = MustOpen(folder / "db", {.read_only = true});
  ASSERT_OK(AddImage(*writer, kImages + 1));
  EXPECT_EQ(CountImages(*reader->GetSnapshot()), kImages);
  ASSERT_OK(reader->Reopen());
  EXPECT_EQ(CountImages(*reader->GetSnapshot()), kImages + 1);
}

}  // namespace
}  // namespace veduta
