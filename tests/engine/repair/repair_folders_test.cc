// SPDX-License-Identifier: Apache-2.0
// Goal: the folders of a repair never collide, leftovers go, and a switch that was cut short is
//   recognised and finished; no name of a photo leads out of its folder.
// Method: folders are made by hand in the states that kills leave.
#include "engine/repair/repair_folders.h"

#include <gtest/gtest.h>

#include <filesystem>

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

TEST(RepairFolders, FinishesASwitchWhereTheDatabaseIsAway) {
  const TemporaryFolder folder;
  const RepairFolders folders = RepairFoldersFor(folder / "db");
  EXPECT_FALSE(IsSwitchUnfinished(folders));
  fs::create_directory(folders.repaired);
  EXPECT_TRUE(IsSwitchUnfinished(folders));
  ASSERT_OK(FinishSwitch(folders));
  EXPECT_TRUE(fs::exists(folders.database));
  EXPECT_FALSE(IsSwitchUnfinished(folders));
}

TEST(RepairFolders, DeletesLeftovers) {
  const TemporaryFolder folder;
  const RepairFolders folders = RepairFoldersFor(folder / "db");
  for (const std::string& path :
       {folders.database, folders.source, folders.repairing, folders.repaired})
    fs::create_directory(path);
  ASSERT_OK(DeleteLeftovers(folders));
  EXPECT_TRUE(fs::exists(folders.database));
  EXPECT_FALSE(fs::exists(folders.source));
  EXPECT_FALSE(fs::exists(folders.repairing));
  EXPECT_FALSE(fs::exists(folders.repaired));
  EXPECT_OK(CheckRoom(folders));
}

TEST(RepairFolders, KeepsFilesInside) {
  const TemporaryFolder folder;
  ASSERT_OK(WriteFileInside(folder / "out", "walk/1.jpg", {1, 2}));
  ASSERT_OK(WriteFileInside(folder / "out", "../../2.jpg", {1, 2}));
  ASSERT_OK(WriteFileInside(folder / "out", "/3.jpg", {1, 2}));
  for (const char* name : {"walk/1.jpg", "2.jpg", "3.jpg"})
    EXPECT_EQ(fs::file_size(folder / (std::string("out/") + name)), 2u);
  ASSERT_OK(WriteTextDurably(folder / "report.txt", "three"));
  EXPECT_EQ(fs::file_size(folder / "report.txt"), 5u);
  EXPECT_FALSE(WriteTextDurably(folder / "none/report.txt", "three").ok());
}

}  // namespace
}  // namespace veduta
