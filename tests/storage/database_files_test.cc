// SPDX-License-Identifier: Apache-2.0
// Goal: what other threads do to the files meanwhile fails no commit.
// Method: RocksDB's log has gone at the moment when its size is asked for.
#include "storage/database_files.h"

#include <gtest/gtest.h>
#include <rocksdb/file_system.h>

#include <atomic>
#include <memory>
#include <string>

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

}  // namespace
}  // namespace veduta
