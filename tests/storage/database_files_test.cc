// SPDX-License-Identifier: Apache-2.0
// Goal: what other threads do to the files meanwhile fails no commit; whoever opens the database
//   has little to replay, and closing loses nothing whatever the disk does.
// Method: RocksDB's log has gone at the moment when its size is asked for; large photos are
//   written, and writes of the closing fail.
#include "storage/database_files.h"

#include <gtest/gtest.h>
#include <rocksdb/file_system.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "fault_file_system.h"
#include "log_damage.h"

namespace veduta {
namespace {

// Says once that a log has gone, after it was told to.
class LogGoesOnce final : public rocksdb::FileSystemWrapper {
 public:
  LogGoesOnce() : FileSystemWrapper(rocksdb::FileSystem::Default()) {}
  const char* Name() const override { return "LogGoesOnce"; }
  rocksdb::IOStatus GetFileSize(const std::string& path, const rocksdb::IOOptions& options,
                                uint64_t* size_bytes, rocksdb::IODebugContext* debug) override {
    if (path.ends_with(".log") && is_armed.exchange(false))
      return rocksdb::IOStatus::PathNotFound(path);
    return target()->GetFileSize(path, options, size_bytes, debug);
  }

  std::atomic<bool> is_armed = false;
};

TEST(DatabaseFiles, LogThatIsReplacedMeanwhileFailsNoCommit) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  const auto file_system = std::make_shared<LogGoesOnce>();
  DatabaseOptions options;
  options.file_system = file_system;
  const auto database = MustOpen(folder / "db", options);
  file_system->is_armed = true;
  EXPECT_OK(AddImage(*database, 1));
  EXPECT_FALSE(file_system->is_armed) << "a commit asks for the size of the log";
}

uint64_t LogBytes(const std::string& folder) {
  uint64_t bytes = 0;
  for (const std::string& log : LogsOf(folder)) bytes += std::filesystem::file_size(log);
  return bytes;
}

TEST(DatabaseFiles, ClosingLeavesLittleToReplay) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t id = 1; id <= 3; ++id) ASSERT_OK(AddImage(*database, id, 5u << 20));
  EXPECT_GT(LogBytes(folder / "db"), 15u << 20);
  database.reset();
  EXPECT_LT(LogBytes(folder / "db"), 1u << 20);
  EXPECT_EQ(CountImages(*MustOpen(folder / "db", {.read_only = true})), 3u);
  // What is little stays in the log.
  database = MustOpen(folder / "db", {});
  ASSERT_OK(AddImage(*database, 4, 1u << 20));
  database.reset();
  EXPECT_GT(LogBytes(folder / "db"), 1u << 20);
  EXPECT_EQ(CountImages(*MustOpen(folder / "db", {.read_only = true})), 4u);
}

TEST(DatabaseFiles, ClosingLosesNothingWhereWritesFail) {
  bool has_failed = true;
  for (uint64_t n = 1; has_failed; n += 5) {  // most of RocksDB's own writes are alike
    SCOPED_TRACE("write operation " + std::to_string(n) + " failed");
    const TemporaryFolder folder;
    const auto fs = std::make_shared<FaultFileSystem>();
    auto database = MustCreate(folder / "db", {.file_system = fs});
    for (uint32_t id = 1; id <= 2; ++id) ASSERT_OK(AddImage(*database, id, 5u << 20));
    fs->FailWrites(n, Fault::kNoSpace, FaultFileSystem::kForever);
    database.reset();
    has_failed = fs->fault_count() > 0;
    fs->DropUnsyncedData();
    EXPECT_EQ(CountImages(*MustOpen(folder / "db", {.file_system = fs})), 2u);
    if (HasFailure()) break;
  }
}

}  // namespace
}  // namespace veduta
