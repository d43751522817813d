// SPDX-License-Identifier: Apache-2.0
// Goal: after a purge no file of the database has 64 bytes in a row of a removed photo, of its
//   features or of its name, wherever RocksDB had them: in its log, in tables, in blob files, in
//   logs that were set aside. What was not removed is whole, and a purge that cannot be complete
//   says so.
// Method: photos of random bytes, removed while they are in the log, in one blob file or in many;
//   all files are searched for all windows, before the purge too, where they must be found.
#include "storage/purge.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "byte_windows.h"
#include "samples.h"

namespace veduta {
namespace {

constexpr uint32_t kImageCount = 12;
constexpr size_t kPhotoBytes = 3000;

std::vector<uint8_t> PhotoOf(uint32_t id) {
  return SampleBytes(1'000'000 * id, kPhotoBytes);
}

// Seeds lie far apart, for SeededRandom counts up: two of nearby seeds share runs of bytes.
Features FeaturesOf(uint32_t id) {
  return SampleFeatures(1'000'000 * id + 200'000, 20);
}

// As long as a window, and without a run that another one has.
std::string NameOf(uint32_t id) {
  std::string name;
  for (const uint8_t byte : SampleBytes(1'000'000 * id + 100'000, 80))
    name.push_back(static_cast<char>('a' + byte % 26));
  return name;
}

ImageRecord ImageOf(uint32_t id) {
  ImageRecord image = SampleImage(id);
  image.name = NameOf(id);
  image.photo = HashContent(PhotoOf(id));
  return image;
}

void AddImage(Database* database, uint32_t id) {
  const ImageRecord image = ImageOf(id);
  ASSERT_OK(database->WritePhotoAhead(image.photo, PhotoOf(id), FeaturesOf(id)));
  auto transaction = database->BeginTransaction();
  transaction->PutImage(image);
  if (id > 1) transaction->PutPair(SamplePair(id - 1, id, 30));
  ASSERT_OK(transaction->Commit());
}

void Remove(Database* database, std::initializer_list<uint32_t> ids) {
  for (const uint32_t id : ids) {
    auto transaction = database->BeginTransaction();
    transaction->RemoveImage(ImageId(id));
    ASSERT_OK(transaction->Commit());
  }
}

// Names too where asked for: RocksDB's manifest has the first and the last key of each table until
// the database is opened again.
ByteWindows WindowsOf(std::initializer_list<uint32_t> ids, bool with_names = false) {
  ByteWindows windows;
  for (const uint32_t id : ids) {
    windows.Add(PhotoOf(id));
    windows.Add(FeaturesOf(id).descriptors);
    if (!with_names) continue;
    const std::string name = NameOf(id);
    windows.Add({reinterpret_cast<const uint8_t*>(name.data()), name.size()});
  }
  return windows;
}

void ExpectWhole(const Snapshot& snapshot, uint32_t id) {
  const auto photo = snapshot.GetPhoto(ImageOf(id).photo);
  ASSERT_OK(photo);
  EXPECT_EQ(std::vector<uint8_t>(photo->bytes().begin(), photo->bytes().end()), PhotoOf(id));
  EXPECT_OK(snapshot.GetFeatures(ImageOf(id).photo));
  EXPECT_OK(snapshot.GetImage(ImageId(id)));
}

TEST(Purge, LeavesNothingThatIsInTheLog) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t id = 1; id <= kImageCount; ++id) AddImage(database.get(), id);
  Remove(database.get(), {5});
  const ByteWindows windows = WindowsOf({5});
  EXPECT_FALSE(windows.FilesWithOne(folder / "db").empty()) << "the search finds what is there";
  ASSERT_OK(database->PurgeDeleted());
  EXPECT_EQ(windows.FilesWithOne(folder / "db"), std::vector<std::string>());
  for (const uint32_t id : {1u, 4u, 6u, 12u}) ExpectWhole(*database->GetSnapshot(), id);
}

// Each batch of images in table and blob files of its own.
TEST(Purge, LeavesNothingInTablesAndBlobFiles) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t id = 1; id <= kImageCount; ++id) {
    AddImage(database.get(), id);
    if (id % 4 == 0) {
      ASSERT_OK(database->Compact());
    }
  }
  database.reset();
  database = MustOpen(folder / "db", {});
  Remove(database.get(), {2, 7});
  const ByteWindows windows = WindowsOf({2, 7});
  ASSERT_OK(database->Compact());
  EXPECT_FALSE(windows.FilesWithOne(folder / "db").empty()) << "an ordinary compaction leaves them";
  ASSERT_OK(database->PurgeDeleted());
  EXPECT_EQ(windows.FilesWithOne(folder / "db"), std::vector<std::string>());
  ASSERT_OK(database->Reopen());
  EXPECT_EQ(WindowsOf({2, 7}, true).FilesWithOne(folder / "db"), std::vector<std::string>());
  for (uint32_t id = 1; id <= kImageCount; ++id) {
    if (id != 2 && id != 7) ExpectWhole(*database->GetSnapshot(), id);
  }
}

TEST(Purge, SparesBlobFilesThatAreYoungerThanWhatWasDeleted) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t id = 1; id <= kImageCount; ++id) {
    AddImage(database.get(), id);
    if (id % 4 == 0) {
      ASSERT_OK(database->Compact());
    }
  }
  const auto copied = [&] { return database->GetStatistics()->blob_copied_bytes; };
  ASSERT_EQ(copied(), 0u) << "photos are not copied by themselves";
  Remove(database.get(), {1});
  ASSERT_OK(database->PurgeDeleted());
  // Three photos and their features of the first of three files; the other eight stay.
  EXPECT_GT(copied(), 3 * kPhotoBytes);
  EXPECT_LT(copied(), 5 * (kPhotoBytes + 20 * 152));
  const uint64_t before = copied();
  ASSERT_OK(database->PurgeDeleted());
  EXPECT_EQ(copied(), before) << "nothing is deleted any more";
}

TEST(Purge, DeletesLogsThatWereSetAside) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  AddImage(database.get(), 1);
  std::filesystem::create_directories(folder / "db/set-aside/1");
  const std::vector<uint8_t> photo = PhotoOf(1);
  std::ofstream(folder / "db/set-aside/1/000004.log", std::ios::binary)
      .write(reinterpret_cast<const char*>(photo.data()),
             static_cast<std::streamsize>(photo.size()));
  Remove(database.get(), {1});
  ASSERT_OK(database->PurgeDeleted());
  EXPECT_EQ(WindowsOf({1}).FilesWithOne(folder / "db"), std::vector<std::string>());
  EXPECT_FALSE(std::filesystem::exists(folder / "db/set-aside"));
}

TEST(Purge, IsRefusedWhileSomebodyReadsAnEarlierState) {
  const TemporaryFolder folder;
  {
    auto database = MustCreate(folder / "db");
    for (uint32_t id = 1; id <= 3; ++id) AddImage(database.get(), id);
  }
  const auto files = DatabaseFiles::Open(folder / "db", {});
  ASSERT_OK(files);
  const rocksdb::Snapshot* const held = (*files)->db().GetSnapshot();
  ASSERT_TRUE((*files)
                  ->db()
                  .Delete(rocksdb::WriteOptions(), (*files)->handle(Family::kPhotos),
                          std::string(reinterpret_cast<const char*>(ImageOf(2).photo.bytes.data()),
                                      ImageOf(2).photo.bytes.size()))
                  .ok());
  EXPECT_EQ(PurgeDeletedFrom(**files, std::chrono::milliseconds(0)).code(), StatusCode::kBusy);
  (*files)->db().ReleaseSnapshot(held);
  EXPECT_OK(PurgeDeletedFrom(**files, std::chrono::milliseconds(0)));
  ByteWindows photo;
  photo.Add(PhotoOf(2));
  EXPECT_EQ(photo.FilesWithOne(folder / "db"), std::vector<std::string>());
}

TEST(Purge, NeedsADatabaseThatIsOpenForWriting) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  EXPECT_EQ(MustOpen(folder / "db", {.read_only = true})->PurgeDeleted().code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
