// SPDX-License-Identifier: Apache-2.0
// Goal: of a damaged log everything comes back that can be read, in its order, and the log as it
//   was found is kept.
// Method: one record of a log damaged, or a file of it removed; every write of the salvage fails
//   once, and it is done again.
#include "storage/log_salvage.h"

#include <gtest/gtest.h>

#include "fault_file_system.h"
#include "log_damage.h"
#include "storage/acknowledged.h"

namespace veduta {
namespace {

constexpr uint32_t kImages = 20;

class LogSalvage : public testing::Test {
 protected:
  void SetUp() override {
    const auto database = MustCreate(folder_ / "whole");
    for (uint32_t id = 1; id <= kImages; ++id) ASSERT_OK(AddImage(*database, id));
    CopyAsKilled(folder_ / "whole", path_);
    log_ = LogsOf(path_).back();
    // The creation, and then those of each image: the last one is its commit.
    pieces_ = PiecesOfLog(log_);
  }
  void ExpectAllBut(uint32_t lost) {
    const auto database = MustOpen(path_, {});
    ASSERT_NE(database, nullptr);
    const auto snapshot = database->GetSnapshot();
    EXPECT_EQ(snapshot->GetState()->next_image, kImages + 1);
    for (uint32_t id = 1; id <= kImages; ++id)
      EXPECT_EQ(snapshot->GetImage(ImageId(id)).ok(), id != lost) << id;
    EXPECT_OK(AddImage(*database, kImages + 1));
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "db";
  std::string log_;
  std::vector<LogPiece> pieces_;
};

TEST_F(LogSalvage, WholeLogIsLeftAlone) {
  ASSERT_OK(SalvageLogs(path_, {}));
  EXPECT_FALSE(std::filesystem::exists(path_ + "/" + kSetAsideFolder));
  EXPECT_TRUE(std::filesystem::exists(log_));
  ExpectAllBut(0);
}

TEST_F(LogSalvage, WhatFollowsDamageComesBack) {
  FlipBit(log_, pieces_[kRecordsOfAnImage * 5].begin_bytes + 30);
  std::string damaged;
  const auto fs = rocksdb::FileSystem::Default();
  ASSERT_TRUE(rocksdb::ReadFileToString(fs.get(), log_, &damaged).ok());
  EXPECT_EQ(Database::Open(path_, {}).status().code(), StatusCode::kCorruption);
  ASSERT_OK(SalvageLogs(path_, {}));
  std::string kept;
  const std::string name = std::filesystem::path(log_).filename();
  ASSERT_TRUE(rocksdb::ReadFileToString(fs.get(), path_ + "/set-aside/1/" + name, &kept).ok());
  EXPECT_EQ(kept, damaged);
  ExpectAllBut(5);
}

TEST_F(LogSalvage, FirstRecordMayBeDamagedWhereOneFamilyWasFlushedByItself) {
  CopyWithPhotosFlushed(folder_ / "whole", path_, 3);
  FlipBit(LogsOf(path_).front(), 20);
  ASSERT_OK(SalvageLogs(path_, {}));
  const auto get = [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle*) {
    std::string value;
    EXPECT_TRUE(db.Get({}, "key 0", &value).IsNotFound());
    for (const char* key : {"key 1", "key 2", "last key"})
      EXPECT_TRUE(db.Get({}, key, &value).ok());
  };
  WithRocksdb(path_, get, Family::kPhotos);
  ExpectAllBut(0);
}

TEST_F(LogSalvage, SecondDamageGetsAFolderOfItsOwn) {
  FlipBit(log_, pieces_[kRecordsOfAnImage * 5].begin_bytes + 30);
  ASSERT_OK(SalvageLogs(path_, {}));
  auto database = MustOpen(path_, {});
  ASSERT_OK(AddImage(*database, kImages + 1));
  ASSERT_OK(AddImage(*database, kImages + 2));
  CopyAsKilled(path_, folder_ / "again");
  FlipBit(LogsOf(folder_ / "again").back(), 50);
  ASSERT_OK(SalvageLogs(folder_ / "again", {}));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "again/set-aside/2"));
  EXPECT_EQ(MustOpen(folder_ / "again", {})->GetSnapshot()->GetState()->next_image, kImages + 3);
}

TEST_F(LogSalvage, MissingLogIsAccepted) {
  std::filesystem::remove(log_);
  EXPECT_EQ(Database::Open(path_, {}).status().code(), StatusCode::kCorruption);
  const Status status = SalvageLogs(path_, {});
  // The creation was in that log, too: there is nothing left to open.
  EXPECT_EQ(status.code(), StatusCode::kNotFound) << status.message();
}

TEST_F(LogSalvage, BusyWhereAnotherHandleIsOpen) {
  const auto database = MustOpen(folder_ / "whole", {});
  EXPECT_EQ(SalvageLogs(folder_ / "whole", {}).code(), StatusCode::kBusy);
}

TEST_F(LogSalvage, MayBeInterruptedAnywhere) {
  FlipBit(log_, pieces_[kRecordsOfAnImage * 5].begin_bytes + 30);
  CopyAsKilled(path_, folder_ / "damaged");
  bool reached = true;
  for (uint64_t n = 1; reached; n += 5) {  // most of RocksDB's own writes are alike
    SCOPED_TRACE("write operation " + std::to_string(n) + " failed");
    CopyAsKilled(folder_ / "damaged", path_);
    const auto fs = std::make_shared<FaultFileSystem>();
    fs->FailWrites(n, Fault::kIoError, FaultFileSystem::kForever);
    const Status status = SalvageLogs(path_, {.file_system = fs});
    reached = fs->fault_count() > 0;
    if (!reached) {
      EXPECT_OK(status);
    }
    fs->DropUnsyncedData();
    ASSERT_OK(SalvageLogs(path_, {}));
    ExpectAllBut(5);
    if (HasFailure()) break;
  }
}

}  // namespace
}  // namespace veduta
