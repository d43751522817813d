// SPDX-License-Identifier: Apache-2.0
// Goal: a folder of backups keeps each content once, reads again only what may have changed, and
//   deletes no file that a backup wants.
// Method: a folder of small files in place of a database, files of the same name with other bytes,
//   and two users of one folder. tests/cli/backup_test.py kills and damages real ones.
#include "storage/backup_folder.h"

#include <filesystem>
#include <fstream>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

class BackupFolderTest : public testing::Test {
 protected:
  BackupFolderTest() { fs::create_directory(source_); }

  void Write(const std::string& name, const std::string& text) {
    fs::remove(source_ + "/" + name);  // RocksDB writes into no file again
    std::ofstream(source_ + "/" + name) << text;
  }
  BackupFolder Open(BackupFolder::Use use = BackupFolder::Use::kChange) {
    auto opened = BackupFolder::Open(path_, use, use == BackupFolder::Use::kChange);
    EXPECT_OK(opened);
    return *std::move(opened);
  }
  BackupFolder::Added Add() {
    auto added = Open().Add(source_, "/the/city", {});
    EXPECT_OK(added);
    return *std::move(added);
  }
  size_t FileCount() const {
    size_t count = 0;
    for ([[maybe_unused]] const auto& entry : fs::directory_iterator(path_ + "/files")) ++count;
    return count;
  }

  TemporaryFolder folder_;
  const std::string source_ = folder_ / "source", path_ = folder_ / "backups";
};

TEST_F(BackupFolderTest, EachContentIsKeptOnce) {
  Write("a", "one");
  Write("b", "one");
  Write("c", "two");
  const auto first = Add();
  EXPECT_EQ(first.backup.number, 1u);
  EXPECT_EQ(first.backup.files.size(), 3u);
  EXPECT_EQ(first.copied_files, 2u);
  EXPECT_EQ(first.copied_bytes, 6u);
  Write("b", "three");
  const auto second = Add();
  EXPECT_EQ(second.copied_files, 1u);
  EXPECT_EQ(FileCount(), 3u);
  BackupFolder backups = Open();
  const auto thinned = backups.Thin(1);
  ASSERT_OK(thinned);
  EXPECT_EQ(*thinned, 1u);
  EXPECT_OK(backups.DropUnused());
  EXPECT_EQ(FileCount(), 3u) << "a, b and c have three contents";
  fs::create_directory(folder_ / "out");
  EXPECT_OK(backups.CopyOut(second.backup, folder_ / "out", {}));
  std::string text;
  std::ifstream(folder_ / "out/b") >> text;
  EXPECT_EQ(text, "three");
}

TEST_F(BackupFolderTest, WhatTheLastBackupHasIsNotReadAgain) {
  Write("a.blob", "this is no blob file");
  EXPECT_EQ(Open().Add(source_, "/the/city", {}).status().code(), StatusCode::kCorruption);
  Write("a", "one");
  fs::remove(source_ + "/a.blob");
  Add();
  // The same size and time in the same place stand for the same bytes.
  const auto time = fs::last_write_time(source_ + "/a");
  std::fstream(source_ + "/a", std::ios::in | std::ios::out) << "two";
  fs::last_write_time(source_ + "/a", time);
  EXPECT_EQ(Add().copied_files, 0u);
  fs::last_write_time(source_ + "/a", time + std::chrono::nanoseconds(1'000));
  EXPECT_EQ(Add().copied_files, 1u);
}

TEST_F(BackupFolderTest, UsersExcludeEachOther) {
  Write("a", "one");
  Add();
  const BackupFolder reads = Open(BackupFolder::Use::kRead);
  EXPECT_OK(BackupFolder::Open(path_, BackupFolder::Use::kRead));
  EXPECT_OK(BackupFolder::Open(path_, BackupFolder::Use::kLook));
  EXPECT_EQ(BackupFolder::Open(path_, BackupFolder::Use::kChange).status().code(),
            StatusCode::kBusy);
}

TEST_F(BackupFolderTest, OtherFoldersAreLeftAlone) {
  Write("a", "one");
  const auto none = BackupFolder::Open(source_, BackupFolder::Use::kChange, /*create=*/true);
  EXPECT_EQ(none.status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(BackupFolder::Open(source_, BackupFolder::Use::kLook).status().code(),
            StatusCode::kNotFound);
  Add();
  EXPECT_EQ(Open().Add(source_, "/another", {}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Open().Add(source_, "/the\ncity", {}).status().code(), StatusCode::kInvalidArgument);
  std::ofstream(path_ + "/VEDUTA-BACKUPS") << "veduta backups 2\n";
  EXPECT_EQ(BackupFolder::Open(path_, BackupFolder::Use::kLook).status().code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
