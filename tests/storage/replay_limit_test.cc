// SPDX-License-Identifier: Apache-2.0
// Goal: nothing behind the limit is replayed, and everything that was committed after the log was
//   inspected.
// Method: the filter is asked as RocksDB asks it; and another process commits, here another handle,
//   while an opening has given the lock back and RocksDB has not taken it yet.
#include "storage/replay_limit.h"

#include <gtest/gtest.h>
#include <rocksdb/file_system.h>
#include <rocksdb/write_batch.h>

#include <functional>
#include <string>

#include "log_damage.h"
#include "storage/log_format.h"

namespace veduta {
namespace {

using Option = rocksdb::WalFilter::WalProcessingOption;

Option Ask(rocksdb::WalFilter& filter, uint64_t log, uint64_t sequence) {
  std::string bytes;
  AppendLittleEndian(sequence, &bytes);
  AppendLittleEndian(uint32_t{0}, &bytes);
  rocksdb::WriteBatch changed;
  bool is_changed = false;
  return filter.LogRecordFound(log, "", rocksdb::WriteBatch(bytes), &changed, &is_changed);
}

TEST(ReplayLimit, HoldsInTheLogsThatWereInspected) {
  const auto filter = MakeReplayLimit(100, 7);
  EXPECT_EQ(Ask(*filter, 6, 100), Option::kContinueProcessing);
  EXPECT_EQ(Ask(*filter, 6, 101), Option::kStopReplay);
  EXPECT_EQ(Ask(*filter, 7, 101), Option::kStopReplay);
  EXPECT_EQ(Ask(*filter, 8, 101), Option::kContinueProcessing);
}

// Does something once, when a lock has first been given back.
class BetweenLocks final : public rocksdb::FileSystemWrapper {
 public:
  explicit BetweenLocks(std::function<void()> act)
      : FileSystemWrapper(rocksdb::FileSystem::Default()), act_(std::move(act)) {}
  const char* Name() const override { return "BetweenLocks"; }
  rocksdb::IOStatus UnlockFile(rocksdb::FileLock* lock, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override {
    const rocksdb::IOStatus status = target()->UnlockFile(lock, options, debug);
    if (const auto act = std::exchange(act_, nullptr)) act();
    return status;
  }

 private:
  std::function<void()> act_;
};

TEST(ReplayLimit, LosesNothingThatAnotherProcessCommitsMeanwhile) {
  const TemporaryFolder folder;
  const std::string path = folder / "db";
  {
    const auto database = MustCreate(folder / "whole");
    ASSERT_OK(AddImage(*database, 1));
    ASSERT_OK(database->WritePhotoAhead(SampleHash(90), SampleBytes(90, 20'000), {}));
    ASSERT_OK(database->WritePhotoAhead(SampleHash(91), SampleBytes(91, 20'000), {}));
    CopyAsKilled(folder / "whole", path);
  }
  // A hole in an end that was never synced.
  const std::string log = LogsOf(path).back();
  const auto pieces = PiecesOfLog(log);
  std::fstream file(log, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(
      static_cast<std::streamoff>((pieces[pieces.size() - 2].begin_bytes / 4096 + 2) * 4096));
  file << std::string(4096, '\0');
  file.close();

  DatabaseOptions options;
  options.file_system = std::make_shared<BetweenLocks>([&] {
    const auto other = MustOpen(path, {});
    for (uint32_t id = 2; id <= 9; ++id) ASSERT_OK(AddImage(*other, id));
  });
  const auto database = MustOpen(path, options);
  ASSERT_NE(database, nullptr);
  EXPECT_EQ(CountImages(*database), 9u);
}

}  // namespace
}  // namespace veduta
