// SPDX-License-Identifier: Apache-2.0
// Goal: a database is made only where nothing is, and opens only what is a database of this
//   version and free.
// Method: real folders; a second process by fork; versions changed through RocksDB itself.
#include <gtest/gtest.h>
#include <rocksdb/db.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "damage.h"
#include "samples.h"
#include "storage/database.h"
#include "storage/family_options.h"
#include "storage/records/record_parts.h"

namespace veduta {
namespace {

TEST(DatabaseOpen, CreateRefusesWhatIsThere) {
  const TemporaryFolder folder;
  std::ofstream(folder / "notes.txt") << "mine";
  const Status not_empty = Database::Open(folder.path(), {.create = true}).status();
  EXPECT_EQ(not_empty.code(), StatusCode::kAlreadyExists);
  EXPECT_NE(not_empty.message().find("not empty"), std::string::npos) << not_empty.message();
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1)
      << "it must not leave anything there";

  auto database = MustCreate(folder / "db");
  EXPECT_EQ(Database::Open(folder / "db", {.create = true}).status().code(),
            StatusCode::kAlreadyExists)
      << "while open";
  database.reset();
  EXPECT_EQ(Database::Open(folder / "db", {.create = true}).status().code(),
            StatusCode::kAlreadyExists);
  EXPECT_NE(MustOpen(folder / "db", {}), nullptr);

  std::filesystem::create_directory(folder / "empty");
  EXPECT_NE(MustCreate(folder / "empty"), nullptr);
  EXPECT_EQ(Database::Open(folder / "no/such/parent", {.create = true}).status().code(),
            StatusCode::kIoError);
  EXPECT_EQ(Database::Open("", {.create = true}).status().code(), StatusCode::kInvalidArgument);
}

TEST(DatabaseOpen, OpenRefusesWhatIsNone) {
  const TemporaryFolder folder;
  EXPECT_EQ(Database::Open(folder / "missing", {}).status().code(), StatusCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(folder / "missing"));
  std::ofstream(folder / "notes.txt") << "mine";
  const Status other = Database::Open(folder.path(), {}).status();
  EXPECT_EQ(other.code(), StatusCode::kNotFound);
  EXPECT_NE(other.message().find("not a veduta database"), std::string::npos) << other.message();
  EXPECT_EQ(Database::Open(folder / "notes.txt", {}).status().code(), StatusCode::kInvalidArgument);

  // Somebody else's RocksDB.
  rocksdb::DB* db = nullptr;
  rocksdb::Options options;
  options.create_if_missing = true;
  ASSERT_TRUE(rocksdb::DB::Open(options, folder / "foreign", &db).ok());
  delete db;
  EXPECT_EQ(Database::Open(folder / "foreign", {}).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(Database::Open(folder / "foreign", {.create = true}).status().code(),
            StatusCode::kAlreadyExists);
}

TEST(DatabaseOpen, ManifestThatIsNotThereIsDamage) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  std::ofstream(folder / "db/CURRENT") << "MANIFEST-777777\n";
  for (const bool read_only : {false, true}) {
    const Status status = Database::Open(folder / "db", {.read_only = read_only}).status();
    EXPECT_EQ(status.code(), StatusCode::kCorruption) << status.message();
    EXPECT_NE(status.message().find("CURRENT"), std::string::npos) << status.message();
  }
}

TEST(DatabaseOpen, SecondHandleAndSecondProcessAreBusy) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  const Status here = Database::Open(folder / "db", {}).status();
  EXPECT_EQ(here.code(), StatusCode::kBusy) << here.message();
  EXPECT_NE(here.message().find("in use by another veduta process"), std::string::npos)
      << here.message();

  // The database of the parent is closed in the child's memory image only: the child must run on
  // its own.
  database.reset();
  int ready[2], done[2];
  ASSERT_EQ(pipe(ready), 0);
  ASSERT_EQ(pipe(done), 0);
  const pid_t child = fork();
  if (child == 0) {
    auto held = Database::Open(folder / "db", {});
    char byte = held.ok() ? 'y' : 'n';
    (void)!write(ready[1], &byte, 1);
    (void)!read(done[0], &byte, 1);
    _exit(0);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  ASSERT_EQ(byte, 'y');
  const Status other = Database::Open(folder / "db", {}).status();
  EXPECT_EQ(other.code(), StatusCode::kBusy) << other.message();
  EXPECT_NE(other.message().find("wait for it or stop it"), std::string::npos) << other.message();
  EXPECT_NE(MustOpen(folder / "db", {.read_only = true}), nullptr) << "readers take no lock";
  ASSERT_EQ(write(done[1], &byte, 1), 1);
  waitpid(child, nullptr, 0);
  EXPECT_NE(MustOpen(folder / "db", {}), nullptr);
}

// As format 1 left it: without the families of the dense pass.
void MakeFormatOne(const std::string& path, bool drop_points) {
  WithRocksdb(
      path,
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* meta) {
        ASSERT_TRUE(
            db.Put(rocksdb::WriteOptions(), meta, rocksdb::Slice("format"), EncodeU32(1)).ok());
      },
      Family::kMeta);
  std::vector<Family> dropped = {Family::kDense, Family::kDepth, Family::kVolume, Family::kSurface};
  if (drop_points) dropped.push_back(Family::kPoints);
  for (const Family family : dropped) {
    WithRocksdb(
        path,
        [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.DropColumnFamily(handle).ok());
        },
        family);
  }
}

TEST(DatabaseOpen, FormatOneIsUpgradedByWhoeverWrites) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutCamera({CameraId(1), "first", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, "y"});
  ASSERT_OK(transaction->Commit());
  transaction.reset();
  database.reset();
  MakeFormatOne(folder / "db", /*drop_points=*/false);
  const Status reader = Database::Open(folder / "db", {.read_only = true}).status();
  EXPECT_EQ(reader.code(), StatusCode::kCorruption);
  EXPECT_NE(reader.message().find("veduta settle"), std::string::npos) << reader.message();
  MustOpen(folder / "db", {}).reset();
  database = MustOpen(folder / "db", {.read_only = true});
  EXPECT_EQ(database->GetSnapshot()->ListCameras()->size(), 1u);
  EXPECT_TRUE(database->GetSnapshot()->dense().ListSettings()->empty());
}

TEST(DatabaseOpen, FormatOneThatLostAFamilyIsNotUpgraded) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  MakeFormatOne(folder / "db", /*drop_points=*/true);
  const Status lost = Database::Open(folder / "db", {}).status();
  EXPECT_EQ(lost.code(), StatusCode::kCorruption);
  EXPECT_NE(lost.message().find("lost its family points"), std::string::npos) << lost.message();
}

TEST(DatabaseOpen, OtherVersionsAreNamed) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  WithRocksdb(
      folder / "db",
      [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* meta) {
        ASSERT_TRUE(db.Put(rocksdb::WriteOptions(), meta, rocksdb::Slice("format"),
                           EncodeU32(kFormatVersion + 5))
                        .ok());
      },
      Family::kMeta);
  const Status newer = Database::Open(folder / "db", {}).status();
  EXPECT_EQ(newer.code(), StatusCode::kCorruption);
  EXPECT_NE(newer.message().find("format 12"), std::string::npos) << newer.message();
  EXPECT_NE(newer.message().find("format 7"), std::string::npos) << newer.message();
  // A family of a later version: RocksDB would not even open it.
  WithRocksdb(
      folder / "db",
      [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle*) {
        rocksdb::ColumnFamilyHandle* handle = nullptr;
        ASSERT_TRUE(db.CreateColumnFamily(rocksdb::ColumnFamilyOptions(), "murals", &handle).ok());
        db.DestroyColumnFamilyHandle(handle);
      },
      Family::kMeta);
  for (const bool read_only : {false, true}) {
    const Status family = Database::Open(folder / "db", {.read_only = read_only}).status();
    EXPECT_EQ(family.code(), StatusCode::kCorruption);
    EXPECT_NE(family.message().find("format 12"), std::string::npos) << family.message();
    EXPECT_NE(family.message().find("murals"), std::string::npos) << family.message();
  }
}

TEST(DatabaseOpen, InterruptedCreationIsFinishedByCreatingAgain) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  WithRocksdb(
      folder / "db",
      [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* meta) {
        ASSERT_TRUE(db.Delete(rocksdb::WriteOptions(), meta, rocksdb::Slice("format")).ok());
      },
      Family::kMeta);
  const Status interrupted = Database::Open(folder / "db", {}).status();
  EXPECT_EQ(interrupted.code(), StatusCode::kNotFound);
  EXPECT_NE(interrupted.message().find("interrupted"), std::string::npos) << interrupted.message();
  EXPECT_NE(MustCreate(folder / "db"), nullptr);
  EXPECT_NE(MustOpen(folder / "db", {}), nullptr);
}

}  // namespace
}  // namespace veduta
