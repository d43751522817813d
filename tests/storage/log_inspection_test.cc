// SPDX-License-Identifier: Apache-2.0
// Goal: whatever was acknowledged and is no longer in the log is noticed before RocksDB deletes the
//   log, for writing and for reading, and nothing is changed then; what a killed process and a
//   power cut leave opens.
// Method: copies of an open database's folder, with its log damaged at known places.
#include "storage/log_inspection.h"

#include <gtest/gtest.h>

#include <map>

#include "fault_file_system.h"
#include "log_damage.h"
#include "storage/acknowledged.h"
#include "storage/log_writer.h"

namespace veduta {
namespace {

constexpr uint32_t kImages = 20;

std::map<std::string, std::string> FilesOf(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().filename() == "LOCK") continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    files[entry.path().filename()] = std::string(std::istreambuf_iterator<char>(stream), {});
  }
  return files;
}

class LogInspection : public testing::Test {
 protected:
  void SetUp() override {
    const auto database = MustCreate(folder_ / "whole");
    for (uint32_t id = 1; id <= kImages; ++id) ASSERT_OK(AddImage(*database, id));
    CopyAsKilled(folder_ / "whole", path_);
    log_ = LogsOf(path_).back();
    pieces_ = PiecesOfLog(log_);
    ASSERT_EQ(pieces_.size(), 1 + kRecordsOfAnImage * kImages);  // after the creation
  }

  // The message, which must name `words`, of both kinds of opening.
  void ExpectRefused(const std::string& words) {
    const auto before = FilesOf(path_);
    for (const bool read_only : {true, false}) {
      const Status status = Database::Open(path_, {.read_only = read_only}).status();
      EXPECT_EQ(status.code(), StatusCode::kCorruption) << status.message();
      EXPECT_NE(status.message().find(words), std::string::npos) << status.message();
      EXPECT_NE(status.message().find("veduta repair " + path_), std::string::npos);
    }
    EXPECT_EQ(FilesOf(path_), before) << "nothing may be changed or deleted";
  }
  void ExpectOpens(uint32_t images) {
    for (const bool read_only : {true, false}) {
      const auto database = MustOpen(path_, {.read_only = read_only});
      ASSERT_NE(database, nullptr);
      EXPECT_EQ(CountImages(*database), images);
    }
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "db";
  std::string log_;
  std::vector<LogPiece> pieces_;
};

TEST_F(LogInspection, KilledProcessLosesNothing) {
  ExpectOpens(kImages);
  const auto damage = InspectLogs(folder_ / "whole", {});
  ASSERT_OK(damage);
  EXPECT_FALSE(damage->damaged()) << damage->sentence;
}

TEST_F(LogInspection, FlippedBitIsDamageWhereverItIs) {
  const uint64_t size = std::filesystem::file_size(log_);
  for (const uint64_t offset : {uint64_t{20}, size / 4, size / 2, size - 1}) {
    SCOPED_TRACE("byte " + std::to_string(offset));
    CopyAsKilled(folder_ / "whole", path_);
    FlipBit(log_, offset);
    ExpectRefused(std::filesystem::path(log_).filename().string() + " cannot be read from byte ");
  }
}

TEST_F(LogInspection, SaysWhatCanBeReadAndWhatIsMissing) {
  const size_t before = 1 + kRecordsOfAnImage * 5;
  const LogPiece& damaged = pieces_[before];  // the photo of image 6
  FlipBit(log_, damaged.begin_bytes + 100);
  const auto damage = InspectLogs(path_, {});
  ASSERT_OK(damage);
  EXPECT_EQ(damage->records_before, before);
  EXPECT_EQ(damage->records_after, pieces_.size() - before - 1);
  EXPECT_EQ(damage->writes_missing, damaged.count);
  ASSERT_EQ(damage->unreadable_logs.size(), 1u);
  ExpectRefused(std::to_string(damage->records_after) + " records behind that can still be read");
  ExpectRefused("from byte " + std::to_string(damaged.begin_bytes));
}

TEST_F(LogInspection, LengthOfTheLastCommitIsDamage) {
  FlipBit(log_, pieces_.back().begin_bytes + 5);
  ExpectRefused(std::to_string(pieces_.back().count) + " writes cannot");
}

TEST_F(LogInspection, CutBelowWhatWasAcknowledgedIsDamage) {
  std::filesystem::resize_file(log_, pieces_.back().begin_bytes);
  ExpectRefused("its end is missing");
  std::filesystem::resize_file(log_, 0);
  ExpectRefused("its end is missing");
}

TEST_F(LogInspection, DeletedLogIsDamage) {
  std::filesystem::remove(log_);
  ExpectRefused(std::filesystem::path(log_).filename().string() + " is missing");
}

TEST_F(LogInspection, EndThatWasNeverSyncedIsForgiven) {
  // Photos written ahead and not committed; then the same without the file of the mark.
  auto database = MustOpen(folder_ / "whole", {});
  ASSERT_OK(AddImage(*database, kImages + 1));
  ASSERT_OK(database->WritePhotoAhead(SampleHash(90), SampleBytes(90, 20'000), {}));
  ASSERT_OK(database->WritePhotoAhead(SampleHash(91), SampleBytes(91, 20'000), {}));
  for (const bool has_mark : {true, false}) {
    CopyAsKilled(folder_ / "whole", path_);
    if (!has_mark) std::filesystem::remove(path_ + "/" + kAcknowledgedFile);
    const std::string log = LogsOf(path_).back();
    const auto pieces = PiecesOfLog(log);
    const LogPiece &first = pieces[pieces.size() - 4], &second = pieces[pieces.size() - 2];
    std::filesystem::resize_file(log, second.begin_bytes + 5000);
    ExpectOpens(kImages + 1);
    // A page that never arrived, and one behind it that did.
    CopyAsKilled(folder_ / "whole", path_);
    std::fstream file(log, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>((first.begin_bytes / 4096 + 2) * 4096));
    file << std::string(4096, '\0');
    file.close();
    ExpectOpens(kImages + 1);
    EXPECT_FALSE(MustOpen(path_, {})->GetSnapshot()->GetPhoto(SampleHash(91)).ok())
        << "nothing behind the hole";
  }
}

TEST_F(LogInspection, WithoutAMarkATornEndBeforeALaterLogIsForgivenAndAFlippedBitIsNot) {
  std::filesystem::remove(path_ + "/" + kAcknowledgedFile);
  const LogPiece& torn = pieces_[1 + kRecordsOfAnImage * 10];  // the photo of image 11
  auto later = LogWriter::Make(*rocksdb::FileSystem::Default(), path_ + "/000900.log");
  ASSERT_OK(later);
  ASSERT_OK(ReadLog(*rocksdb::FileSystem::Default(), log_, [&](const LogPiece& piece) {
    return piece.begin_bytes > torn.begin_bytes ? later->Add(piece.record) : Status::Ok();
  }));
  ASSERT_OK(later->Finish());
  std::filesystem::resize_file(log_, torn.end_bytes);
  FlipBit(log_, torn.begin_bytes + 100);
  ExpectRefused("cannot be read from byte " + std::to_string(torn.begin_bytes));
  std::filesystem::resize_file(log_, torn.begin_bytes + 100);
  ExpectOpens(10);
}

TEST_F(LogInspection, MarkIsMadeWhereAnOlderProgramLeftNone) {
  std::filesystem::remove(path_ + "/" + kAcknowledgedFile);
  MustOpen(path_, {.read_only = true}).reset();
  EXPECT_FALSE(std::filesystem::exists(path_ + "/" + kAcknowledgedFile));
  auto database = MustOpen(path_, {});
  ASSERT_OK(AddImage(*database, kImages + 1));
  CopyAsKilled(path_, folder_ / "killed");
  std::filesystem::resize_file(LogsOf(folder_ / "killed").back(), 0);
  EXPECT_EQ(Database::Open(folder_ / "killed", {}).status().code(), StatusCode::kCorruption);
}

TEST_F(LogInspection, FlushesAndCompactionsLeaveAWholeLog) {
  const auto database = MustOpen(folder_ / "whole", {});
  for (uint32_t id = kImages + 1; id <= kImages + 12; ++id) {
    ASSERT_OK(AddImage(*database, id, id % 3 == 0 ? 30u << 20 : 5000));  // fills the memtable
    if (id % 5 == 0) {
      ASSERT_OK(database->Compact());
    }
    CopyAsKilled(folder_ / "whole", path_);
    ExpectOpens(id);
  }
}

TEST_F(LogInspection, EachLogOfSeveralIsMissed) {
  const auto database = MustOpen(folder_ / "whole", {});
  for (uint32_t id = kImages + 1; id <= kImages + 6; ++id)
    ASSERT_OK(AddImage(*database, id, 30u << 20));
  const size_t count = LogsOf(folder_ / "whole").size();
  ASSERT_GT(count, 1u) << "the photos have changed the log";
  for (size_t i = 0; i < count; ++i) {
    CopyAsKilled(folder_ / "whole", path_);
    const std::string log = LogsOf(path_)[i];
    std::filesystem::remove(log);
    EXPECT_EQ(Database::Open(path_, {}).status().code(), StatusCode::kCorruption) << log;
  }
}

TEST_F(LogInspection, DamageAtTheBeginIsFoundWhereOneFamilyWasFlushedByItself) {
  CopyWithPhotosFlushed(folder_ / "whole", path_, 3);
  const auto logs = LogsOf(path_);
  ASSERT_EQ(logs.size(), 2u);
  FlipBit(logs.front(), 20);
  ExpectRefused(std::filesystem::path(logs.front()).filename().string() +
                " cannot be read from byte 0 ");
}

TEST_F(LogInspection, WithoutSyncsAPowerCutIsForgivenAndACleanCloseIsNot) {
  const auto fs = std::make_shared<FaultFileSystem>();
  DatabaseOptions options{.create = true, .sync_wal = false, .file_system = fs};
  auto database = MustOpen(folder_ / "loose", options);
  options.create = false;
  for (uint32_t id = 1; id <= 9; ++id) ASSERT_OK(AddImage(*database, id));
  fs->CutPower();
  database.reset();
  fs->DropUnsyncedData();
  database = MustOpen(folder_ / "loose", options);
  ASSERT_NE(database, nullptr);
  const uint32_t first = CountImages(*database) + 1;
  for (uint32_t id = first; id < first + 9; ++id) ASSERT_OK(AddImage(*database, id));
  database.reset();
  const std::string log = LogsOf(folder_ / "loose").back();
  std::filesystem::resize_file(log, std::filesystem::file_size(log) - 1);
  EXPECT_EQ(Database::Open(folder_ / "loose", {}).status().code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
