// SPDX-License-Identifier: Apache-2.0
// Goal: a power cut loses nothing that a synced commit acknowledged, the writes ahead of it
//   included, even where the log was changed in between; without syncs it leaves a prefix of
//   the commits, each whole.
// Method: FaultFileSystem forgets unsynced bytes; photos larger than the memtables force log
//   changes and flushes.
#include <gtest/gtest.h>

#include "fault_file_system.h"
#include "log_damage.h"
#include "samples.h"
#include "storage/database.h"

namespace veduta {
namespace {

class Durability : public testing::Test {
 protected:
  void SetUp() override {
    options_.file_system = fs_;
    options_.create = true;
    database_ = MustOpen(path_, options_);
    options_.create = false;
  }
  void CutPowerAndReopen() {
    fs_->CutPower();
    database_.reset();
    fs_->DropUnsyncedData();
    database_ = MustOpen(path_, options_);
    ASSERT_NE(database_, nullptr);
  }
  Status WritePhoto(uint32_t seed, size_t size_bytes) {
    return database_->WritePhotoAhead(SampleHash(seed), SampleBytes(seed, size_bytes),
                                      SampleFeatures(seed, 50));
  }
  Status CommitImage(uint32_t id) {
    auto transaction = database_->BeginTransaction();
    transaction->PutImage(SampleImage(id));
    DatabaseState state;
    state.next_image = id + 1;
    transaction->PutState(state);
    return transaction->Commit();
  }
  bool HasWholeImage(uint32_t id, size_t size_bytes) {
    const auto snapshot = database_->GetSnapshot();
    const auto photo = snapshot->GetPhoto(SampleHash(id));
    return snapshot->GetImage(ImageId(id)).ok() && photo.ok() &&
           photo->bytes().size() == size_bytes &&
           photo->bytes()[size_bytes / 2] == SampleBytes(id, size_bytes)[size_bytes / 2] &&
           snapshot->GetFeatures(SampleHash(id)).ok();
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "db";
  const std::shared_ptr<FaultFileSystem> fs_ = std::make_shared<FaultFileSystem>();
  DatabaseOptions options_;
  std::unique_ptr<Database> database_;
};

TEST_F(Durability, NewDatabaseOutlivesAPowerCut) {
  CutPowerAndReopen();
  EXPECT_EQ(database_->GetSnapshot()->GetState()->next_image, 1u);
}

TEST_F(Durability, UnsyncedWriteAheadIsLostAlone) {
  ASSERT_OK(WritePhoto(1, 10'000));
  ASSERT_OK(CommitImage(1));
  ASSERT_OK(WritePhoto(2, 10'000));
  CutPowerAndReopen();
  EXPECT_TRUE(HasWholeImage(1, 10'000));
  EXPECT_EQ(database_->GetSnapshot()->GetPhoto(SampleHash(2)).status().code(),
            StatusCode::kNotFound);
}

// The photo waits on whatever becomes of the write: with its camera where that was acknowledged,
// and otherwise as before.
TEST_F(Durability, APhotoThatWaitsKeepsTheCameraThatItWasGiven) {
  const auto camera_of = [&](uint64_t number) {
    const auto snapshot = database_->GetSnapshot();
    EXPECT_EQ(snapshot->GetUploadBytes(number)->bytes().size(), 1'000u);
    return snapshot->GetUpload(number)->camera;
  };
  UploadRecord upload;
  upload.name = "1.jpg";
  upload.contributor = "anna";
  upload.photo = SampleHash(1);
  upload.size_bytes = 1'000;
  const Result<uint64_t> number = database_->AddUpload(upload, SampleBytes(1, 1'000));
  ASSERT_OK(number);
  ASSERT_OK(database_->NameUploadCamera(*number, "first"));
  CutPowerAndReopen();
  EXPECT_EQ(camera_of(*number), "first");
  for (uint64_t n = 1; n <= 2; ++n) {  // the write, and its sync
    fs_->FailWrites(n, Fault::kIoError, FaultFileSystem::kForever);
    EXPECT_EQ(database_->NameUploadCamera(*number, "second").code(), StatusCode::kIoError) << n;
    fs_->Heal();
    CutPowerAndReopen();
    EXPECT_EQ(camera_of(*number), "first") << n;
  }
  EXPECT_EQ(database_->NameUploadCamera(*number + 1, "second").code(), StatusCode::kNotFound);
}

// 64 MiB fill the photos' memtable: the log changes and a flush begins between write-ahead and
// commit.
TEST_F(Durability, CommitCoversWriteAheadsInOlderLogs) {
  constexpr uint32_t kCount = 10;
  constexpr size_t kSize = 15u << 20;
  for (uint32_t id = 1; id <= kCount; ++id) ASSERT_OK(WritePhoto(id, kSize));
  auto transaction = database_->BeginTransaction();
  for (uint32_t id = 1; id <= kCount; ++id) transaction->PutImage(SampleImage(id));
  ASSERT_OK(transaction->Commit());
  CutPowerAndReopen();
  for (uint32_t id = 1; id <= kCount; ++id) EXPECT_TRUE(HasWholeImage(id, kSize)) << id;
}

TEST_F(Durability, CompactionBetweenCommitsLosesNothing) {
  for (uint32_t id = 1; id <= 12; ++id) {
    ASSERT_OK(WritePhoto(id, 5000));
    if (id % 3 == 0) {
      ASSERT_OK(database_->Compact());
    }
    ASSERT_OK(CommitImage(id));
    if (id % 4 == 0) CutPowerAndReopen();
  }
  for (uint32_t id = 1; id <= 12; ++id) EXPECT_TRUE(HasWholeImage(id, 5000)) << id;
}

// RocksDB keeps a log of which it could read nothing, and would stop there at the opening after the
// next, before the log with the commits.
TEST_F(Durability, CommitsBehindALogThatBeganTornAreKept) {
  const auto crash = [&] {
    fs_->CutPower();
    database_.reset();
    fs_->Heal();
  };
  for (const bool is_zeros : {false, true}) {
    database_.reset();
    database_ = MustOpen(path_, options_);
    ASSERT_OK(WritePhoto(9, 10'000));  // not synced: the power cut leaves some of it
    crash();
    const std::string log = LogsOf(path_).back();
    ASSERT_GT(std::filesystem::file_size(log), 10'000u);
    std::filesystem::resize_file(log, is_zeros ? 0 : 5000);
    if (is_zeros) std::filesystem::resize_file(log, 5000);
    for (const uint32_t id : {1u, 2u}) {
      database_ = MustOpen(path_, options_);
      ASSERT_NE(database_, nullptr) << "image " << id << ", zeros " << is_zeros;
      ASSERT_OK(WritePhoto(id + 10 * is_zeros, 3000));
      ASSERT_OK(CommitImage(id + 10 * is_zeros));
      crash();
    }
    database_ = MustOpen(path_, options_);
    ASSERT_NE(database_, nullptr);
    for (const uint32_t id : {1u, 2u}) EXPECT_TRUE(HasWholeImage(id + 10 * is_zeros, 3000));
  }
}

TEST_F(Durability, CheckpointOutlivesAPowerCut) {
  ASSERT_OK(WritePhoto(1, 5000));
  ASSERT_OK(CommitImage(1));
  ASSERT_OK(database_->CreateCheckpoint(folder_ / "copy"));
  CutPowerAndReopen();
  database_ = MustOpen(folder_ / "copy", options_);
  ASSERT_NE(database_, nullptr);
  EXPECT_TRUE(HasWholeImage(1, 5000));
}

TEST_F(Durability, WithoutSyncsAPrefixIsLeft) {
  database_.reset();
  options_.sync_wal = false;
  database_ = MustOpen(path_, options_);
  for (uint32_t id = 1; id <= 30; ++id) {
    ASSERT_OK(WritePhoto(id, 3u << 20));
    ASSERT_OK(CommitImage(id));
  }
  CutPowerAndReopen();
  const uint32_t next = database_->GetSnapshot()->GetState()->next_image;
  EXPECT_LE(next, 31u);
  for (uint32_t id = 1; id <= 30; ++id) {
    EXPECT_EQ(HasWholeImage(id, 3u << 20), id < next) << id << " of " << next;
  }
  // A crash of the process alone loses nothing.
  ASSERT_OK(WritePhoto(77, 5000));
  ASSERT_OK(CommitImage(77));
  database_.reset();
  database_ = MustOpen(path_, options_);
  EXPECT_TRUE(HasWholeImage(77, 5000));
}

}  // namespace
}  // namespace veduta
