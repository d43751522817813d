// SPDX-License-Identifier: Apache-2.0
// Goal: the folders of a repair never collide, leftovers go, and a switch that was cut short is
//   recognised and finished; no name of a photo leads out of its folder.
// Method: folders are made by hand in the states that kills leave.
#include "engine/repair/repair_folders.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

TEST(RepairFolders, TakesTheFirstNumberThatIsFree) {
  const TemporaryFolder folder;
  EXPECT_EQ(RepairFoldersFor(folder / "db/").database, folder / "db");
  EXPECT_EQ(RepairFoldersFor(folder / "db").kept, folder / "db.damaged-1");
  fs::create_directory(folder / "db.damaged-1");
  EXPECT_EQ(RepairFoldersFor(folder / "db").kept, folder / "db.damaged-2");
  EXPECT_EQ(RepairFoldersFor(folder / "db").report, folder / "db.damaged-2.txt");
}

TEST(RepairFolders, LieBesideTheFolderThatAPathLeadsTo) {
  const TemporaryFolder folder;
  const std::string real = fs::canonical(folder.path()) / "db";
  fs::create_directories(real);
  fs::create_directory(folder / "elsewhere");
  fs::create_directory_symlink(real, folder / "elsewhere/link");
  fs::create_directory_symlink("../later", folder / "elsewhere/dangling");
  for (const std::string& path :
       {real + "/.", real + "/", real + "/../db", folder / "elsewhere/link"}) {
    EXPECT_EQ(RepairFoldersFor(path).database, real) << path;
    EXPECT_EQ(RepairFoldersFor(path).repairing, real + ".repairing") << path;
  }
  EXPECT_EQ(RepairFoldersFor(folder / "elsewhere/dangling").database,
            fs::canonical(folder.path()) / "later");
  const fs::path before = fs::current_path();
  fs::current_path(real);
  EXPECT_EQ(RepairFoldersFor(".").database, real);
  fs::current_path(before);
}

TEST(RepairFolders, AreRefusedWhereAFileSystemIsMounted) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "db");
  EXPECT_OK(CheckCanBeRenamed(RepairFoldersFor(folder / "db")));
  const Status status = CheckCanBeRenamed(RepairFoldersFor("/proc"));
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("mounted at /proc"), std::string::npos) << status.message();
}

// A damaged database with a complete new one; each says by a file which one it is.
class RepairSwitch : public testing::Test {
 protected:
  void SetUp() override {
    for (const std::string& path : {folders_.database, folders_.repairing})
      fs::create_directory(path);
    ASSERT_OK(WriteTextDurably(folders_.database + "/what", "damaged"));
    ASSERT_OK(WriteTextDurably(folders_.repairing + "/what", "new"));
    ASSERT_OK(CompleteSwitch(folders_));
  }
  static std::string What(const std::string& folder) {
    std::ifstream file(folder + "/what");
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  void ExpectSwitched() const {
    EXPECT_EQ(What(folders_.database), "new");
    EXPECT_EQ(What(folders_.kept), "damaged");
    EXPECT_FALSE(fs::exists(folders_.repaired));
    EXPECT_FALSE(fs::exists(folders_.repaired_for));
    EXPECT_EQ(FindSwitch(folders_), SwitchState::kNone);
  }

  const TemporaryFolder folder_;
  const RepairFolders folders_ = RepairFoldersFor(folder_ / "db");
};

TEST_F(RepairSwitch, IsBegunAnewWhereNothingWasMoved) {
  EXPECT_EQ(FindSwitch(folders_), SwitchState::kNone);
  ASSERT_OK(DeleteLeftovers(folders_));
  EXPECT_EQ(What(folders_.database), "damaged");
  EXPECT_FALSE(fs::exists(folders_.repaired));
  EXPECT_FALSE(fs::exists(folders_.repaired_for));
}

TEST_F(RepairSwitch, ExchangesInOneStep) {
  ASSERT_OK(BeginSwitch(folders_));
  if (!fs::exists(folders_.database)) GTEST_SKIP() << "this file system exchanges no folders";
  EXPECT_EQ(FindSwitch(folders_), SwitchState::kExchanged);
  EXPECT_EQ(What(folders_.database), "new");
  ASSERT_OK(DeleteLeftovers(folders_));
  EXPECT_EQ(What(folders_.repaired), "damaged") << "the damaged database was deleted";
  ASSERT_OK(FinishSwitch(folders_));
  ExpectSwitched();
}

TEST_F(RepairSwitch, IsFinishedWhereTheDatabaseIsAway) {
  ASSERT_OK(BeginSwitch(folders_, /*may_exchange=*/false));
  EXPECT_EQ(FindSwitch(folders_), SwitchState::kMovedAway);
  ASSERT_OK(DeleteLeftovers(folders_));
  ASSERT_OK(FinishSwitch(folders_));
  ExpectSwitched();
}

TEST_F(RepairSwitch, KeepsTheNewDatabaseWhereAnotherOneTookItsPlace) {
  ASSERT_OK(BeginSwitch(folders_, /*may_exchange=*/false));
  fs::create_directory(folders_.database);  // as 'veduta init' does
  EXPECT_EQ(FindSwitch(folders_), SwitchState::kReplaced);
  const Status refused = DeleteLeftovers(folders_);
  EXPECT_EQ(refused.code(), StatusCode::kAlreadyExists);
  EXPECT_NE(refused.message().find("db.repaired"), std::string::npos) << refused.message();
  EXPECT_EQ(What(folders_.repaired), "new");
}

TEST(RepairFolders, DeletesLeftovers) {
  const TemporaryFolder folder;
  const RepairFolders folders = RepairFoldersFor(folder / "db");
  for (const std::string& path : {folders.database, folders.source, folders.repairing})
    fs::create_directory(path);
  ASSERT_OK(DeleteLeftovers(folders));
  EXPECT_TRUE(fs::exists(folders.database));
  EXPECT_FALSE(fs::exists(folders.source));
  EXPECT_FALSE(fs::exists(folders.repairing));
  EXPECT_OK(CheckRoom(folders));
}

TEST(RepairFolders, KeepsFilesInside) {
  const TemporaryFolder folder;
  ASSERT_OK(WriteFileInside(folder / "out", "walk/1.jpg", "x", {1, 2}));
  ASSERT_OK(WriteFileInside(folder / "out", "../../2.jpg", "x", {1, 2}));
  ASSERT_OK(WriteFileInside(folder / "out", "/3.jpg", "x", {1, 2}));
  for (const char* name : {"walk/1.jpg", "2.jpg", "3.jpg"})
    EXPECT_EQ(fs::file_size(folder / (std::string("out/") + name)), 2u);
  ASSERT_OK(WriteTextDurably(folder / "report.txt", "three"));
  EXPECT_EQ(fs::file_size(folder / "report.txt"), 5u);
  EXPECT_FALSE(WriteTextDurably(folder / "none/report.txt", "three").ok());
}

TEST(RepairFolders, WritesEachFileWhereNamesCollide) {
  const TemporaryFolder folder;
  const std::string out = folder / "out";
  ASSERT_OK(WriteFileInside(out, "a", "01", {1}));
  ASSERT_OK(WriteFileInside(out, "a", "01", {1}));
  ASSERT_OK(WriteFileInside(out, "a/b.jpg", "02", {1, 2}));
  ASSERT_OK(WriteFileInside(out, "../a", "03", {1, 2, 3}));
  ASSERT_OK(WriteFileInside(out, "c/d.jpg", "04", {1, 2, 3, 4}));
  ASSERT_OK(WriteFileInside(out, "c", "05", {1, 2, 3, 4, 5}));
  std::map<std::string, uint64_t> sizes;
  for (const auto& entry : fs::recursive_directory_iterator(out)) {
    if (entry.is_regular_file()) sizes[fs::relative(entry.path(), out)] = entry.file_size();
  }
  const std::map<std::string, uint64_t> wanted = {
      {"a", 1}, {"02-b.jpg", 2}, {"03-a", 3}, {"c/d.jpg", 4}, {"05-c", 5}};
  EXPECT_EQ(sizes, wanted);
}

}  // namespace
}  // namespace veduta
