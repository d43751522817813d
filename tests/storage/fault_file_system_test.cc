// SPDX-License-Identifier: Apache-2.0
// Goal: the crash tests' own disk does what it says: it forgets exactly what was not synced and
//   fails exactly the writes it was told to.
// Method: files and folders by hand, without a database.
#include "fault_file_system.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>

#include "samples.h"

namespace veduta {
namespace {

const rocksdb::IOOptions kOptions;

std::unique_ptr<rocksdb::FSWritableFile> Create(FaultFileSystem& fs, const std::string& path) {
  std::unique_ptr<rocksdb::FSWritableFile> file;
  EXPECT_TRUE(fs.NewWritableFile(path, rocksdb::FileOptions(), &file, nullptr).ok());
  return file;
}

void SyncFolder(FaultFileSystem& fs, const std::string& path) {
  std::unique_ptr<rocksdb::FSDirectory> folder;
  ASSERT_TRUE(fs.NewDirectory(path, kOptions, &folder, nullptr).ok());
  ASSERT_TRUE(folder->Fsync(kOptions, nullptr).ok());
}

std::string Content(const std::string& path) {
  if (!std::filesystem::exists(path)) return "(none)";
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void WriteFile(FaultFileSystem& fs, const std::string& path, const std::string& synced,
               const std::string& unsynced) {
  const auto file = Create(fs, path);
  ASSERT_TRUE(file->Append(synced, kOptions, nullptr).ok());
  ASSERT_TRUE(file->Sync(kOptions, nullptr).ok());
  ASSERT_TRUE(file->Append(unsynced, kOptions, nullptr).ok());
  ASSERT_TRUE(file->Close(kOptions, nullptr).ok());
}

TEST(FaultFileSystem, KeepsSyncedBytesOnly) {
  const TemporaryFolder folder;
  FaultFileSystem fs;
  WriteFile(fs, folder / "a", "kept", "lost");
  SyncFolder(fs, folder.path());
  WriteFile(fs, folder / "b", "synced, but its folder is not", "");
  EXPECT_EQ(Content(folder / "a"), "keptlost");
  fs.DropUnsyncedData();
  EXPECT_EQ(Content(folder / "a"), "kept");
  EXPECT_EQ(Content(folder / "b"), "(none)");
}

TEST(FaultFileSystem, UndoesRenamesThatAreNotDurable) {
  const TemporaryFolder folder;
  FaultFileSystem fs;
  WriteFile(fs, folder / "current", "old", "");
  WriteFile(fs, folder / "next", "new", "");
  SyncFolder(fs, folder.path());
  ASSERT_TRUE(fs.RenameFile(folder / "next", folder / "current", kOptions, nullptr).ok());
  EXPECT_EQ(Content(folder / "current"), "new");
  fs.DropUnsyncedData();
  EXPECT_EQ(Content(folder / "current"), "old");
  EXPECT_EQ(Content(folder / "next"), "new");
  ASSERT_TRUE(fs.RenameFile(folder / "next", folder / "current", kOptions, nullptr).ok());
  SyncFolder(fs, folder.path());
  fs.DropUnsyncedData();
  EXPECT_EQ(Content(folder / "current"), "new");
  EXPECT_EQ(Content(folder / "next"), "(none)");
}

TEST(FaultFileSystem, ForgetsFoldersLinksAndWhatIsInThem) {
  const TemporaryFolder folder;
  FaultFileSystem fs;
  ASSERT_TRUE(fs.CreateDirIfMissing(folder / "sub", kOptions, nullptr).ok());
  WriteFile(fs, folder / "sub/file", "bytes", "");
  SyncFolder(fs, folder / "sub");
  WriteFile(fs, folder / "plain", "bytes", "");
  SyncFolder(fs, folder.path());  // makes sub durable too
  ASSERT_TRUE(fs.LinkFile(folder / "plain", folder / "link", kOptions, nullptr).ok());
  ASSERT_TRUE(fs.CreateDir(folder / "later", kOptions, nullptr).ok());
  WriteFile(fs, folder / "later/file", "bytes", "");
  fs.DropUnsyncedData();
  EXPECT_EQ(Content(folder / "sub/file"), "bytes");
  EXPECT_EQ(Content(folder / "plain"), "bytes");
  EXPECT_EQ(Content(folder / "link"), "(none)");
  EXPECT_FALSE(std::filesystem::exists(folder / "later"));
}

TEST(FaultFileSystem, FailsTheChosenWrites) {
  const TemporaryFolder folder;
  FaultFileSystem fs;
  const auto file = Create(fs, folder / "a");
  fs.FailWrites(2, Fault::kNoSpace, 1);
  EXPECT_TRUE(file->Append("one,", kOptions, nullptr).ok());
  const rocksdb::IOStatus torn = file->Append("0123456789", kOptions, nullptr);
  EXPECT_TRUE(torn.IsNoSpace());
  EXPECT_TRUE(file->Append(",three", kOptions, nullptr).ok());
  EXPECT_EQ(Content(folder / "a"), "one,01234,three");
  EXPECT_EQ(fs.fault_count(), 1u);
  EXPECT_EQ(fs.write_count(), 4u);

  fs.FailWrites(1, Fault::kIoError, FaultFileSystem::kForever);
  EXPECT_TRUE(file->Sync(kOptions, nullptr).IsIOError());
  EXPECT_FALSE(fs.RenameFile(folder / "a", folder / "b", kOptions, nullptr).ok());
  EXPECT_FALSE(fs.CreateDir(folder / "c", kOptions, nullptr).ok());
  EXPECT_TRUE(std::filesystem::exists(folder / "a"));
  fs.Heal();
  EXPECT_TRUE(file->Sync(kOptions, nullptr).ok());
}

TEST(FaultFileSystem, NothingBecomesDurableWithoutPower) {
  const TemporaryFolder folder;
  FaultFileSystem fs;
  const auto file = Create(fs, folder / "a");
  SyncFolder(fs, folder.path());
  ASSERT_TRUE(file->Append("unsynced", kOptions, nullptr).ok());
  fs.CutPower();
  EXPECT_FALSE(file->Sync(kOptions, nullptr).ok());
  EXPECT_FALSE(fs.DeleteFile(folder / "a", kOptions, nullptr).ok());
  fs.DropUnsyncedData();
  EXPECT_EQ(Content(folder / "a"), "");
}

// Over many seeds each thing is kept and lost, and never something else.
constexpr uint64_t kSeeds = 200;

TEST(FaultFileSystem, LosesAnyPartOfAnUnsyncedTail) {
  const std::string synced(5000, 's'), tail(20'000, 't');
  std::set<uint64_t> sizes;
  size_t holes = 0, behind_holes = 0;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const TemporaryFolder folder;
    FaultFileSystem fs;
    WriteFile(fs, folder / "a", synced, tail);
    SyncFolder(fs, folder.path());
    fs.LoseUnsyncedData(seed);
    const std::string left = Content(folder / "a");
    ASSERT_GE(left.size(), synced.size());
    ASSERT_EQ(left.substr(0, synced.size()), synced);
    ASSERT_EQ(left.find_first_not_of(std::string("t\0", 2), synced.size()), std::string::npos);
    sizes.insert(left.size());
    const size_t hole = left.find('\0');
    holes += hole != std::string::npos ? 1 : 0;
    if (hole != std::string::npos && left.find('t', hole) != std::string::npos) ++behind_holes;
  }
  EXPECT_TRUE(sizes.contains(synced.size()));
  EXPECT_TRUE(sizes.contains(synced.size() + tail.size()));
  EXPECT_GT(sizes.size(), 20u);
  EXPECT_GT(holes, 20u);
  EXPECT_GT(behind_holes, 20u) << "pages reach the disk in any order";
}

TEST(FaultFileSystem, LosesChangesOfAFolderOneByOne) {
  std::set<std::string> seen;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const TemporaryFolder folder;
    FaultFileSystem fs;
    WriteFile(fs, folder / "deleted", "deleted", "");
    WriteFile(fs, folder / "current", "old", "");
    WriteFile(fs, folder / "next", "new", "");
    SyncFolder(fs, folder.path());
    ASSERT_TRUE(fs.DeleteFile(folder / "deleted", kOptions, nullptr).ok());
    ASSERT_TRUE(fs.RenameFile(folder / "next", folder / "current", kOptions, nullptr).ok());
    WriteFile(fs, folder / "made", "made", "");
    fs.LoseUnsyncedData(seed);
    std::string state;
    for (const char* name : {"deleted", "current", "next", "made"})
      state += Content(folder / name) + " ";
    seen.insert(state);
  }
  std::set<std::string> possible;
  for (const char* deleted : {"deleted ", "(none) "}) {
    for (const char* renamed : {"old new ", "new (none) "}) {
      for (const char* made : {"made ", "(none) "})
        possible.insert(std::string(deleted) + renamed + made);
    }
  }
  EXPECT_EQ(seen, possible);
}

TEST(FaultFileSystem, LosesPagesThatWereWrittenInPlace) {
  std::set<std::string> seen;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const TemporaryFolder folder;
    FaultFileSystem fs;
    WriteFile(fs, folder / "a", std::string(8192, 'o'), "");
    SyncFolder(fs, folder.path());
    std::unique_ptr<rocksdb::FSRandomRWFile> file;
    ASSERT_TRUE(fs.NewRandomRWFile(folder / "a", rocksdb::FileOptions(), &file, nullptr).ok());
    ASSERT_TRUE(file->Write(0, "1", kOptions, nullptr).ok());
    ASSERT_TRUE(file->Sync(kOptions, nullptr).ok());
    ASSERT_TRUE(file->Write(0, "2", kOptions, nullptr).ok());
    ASSERT_TRUE(file->Write(4096, "2", kOptions, nullptr).ok());
    fs.LoseUnsyncedData(seed);
    const std::string left = Content(folder / "a");
    seen.insert({left[0], left[4096]});
  }
  EXPECT_EQ(seen, (std::set<std::string>{"1o", "12", "2o", "22"}));
}

TEST(FaultFileSystem, FailsReadsAndDeletions) {
  const TemporaryFolder folder;
  FaultFileSystem fs;
  WriteFile(fs, folder / "a", "bytes", "");
  std::unique_ptr<rocksdb::FSRandomAccessFile> file;
  ASSERT_TRUE(fs.NewRandomAccessFile(folder / "a", rocksdb::FileOptions(), &file, nullptr).ok());
  fs.Fail(Only(Operation::kRead), 2, Fault::kIoError, 1);
  char scratch[5];
  rocksdb::Slice got;
  EXPECT_TRUE(file->Read(0, 5, kOptions, &got, scratch, nullptr).ok());
  EXPECT_TRUE(file->Read(0, 5, kOptions, &got, scratch, nullptr).IsIOError());
  EXPECT_TRUE(file->Read(0, 5, kOptions, &got, scratch, nullptr).ok());
  EXPECT_EQ(fs.faults()[static_cast<size_t>(Operation::kRead)], 1u);
  fs.Fail(Only(Operation::kDelete), 1, Fault::kIoError, 1);
  EXPECT_FALSE(fs.DeleteFile(folder / "a", kOptions, nullptr).ok());
  EXPECT_EQ(Content(folder / "a"), "bytes");
  EXPECT_TRUE(fs.DeleteFile(folder / "a", kOptions, nullptr).ok());
  EXPECT_EQ(Content(folder / "a"), "(none)");
}

TEST(FaultDisk, FlipsOneBitAndBack) {
  const TemporaryFolder folder;
  FaultFileSystem fs;
  WriteFile(fs, folder / "a", "bytes", "");
  SeededRandom random(1);
  const BitFlip flip = ChooseBitFlip(folder.path(), &random);
  EXPECT_EQ(flip.path, folder / "a");
  Apply(flip);
  EXPECT_NE(Content(folder / "a"), "bytes");
  EXPECT_EQ(Content(folder / "a").size(), 5u);
  Apply(flip);
  EXPECT_EQ(Content(folder / "a"), "bytes");
}

}  // namespace
}  // namespace veduta
