// SPDX-License-Identifier: Apache-2.0
// Goal: a database keeps every record over a restart, shows each reader one moment, lets one of
//   two conflicting transactions through, and names what is damaged.
// Method: real folders; values changed through RocksDB itself.
#include "storage/database.h"
#include "storage/records/families.h"
#include "storage/records/image_record.h"
#include "storage/records/state_record.h"

#include <gtest/gtest.h>
#include <rocksdb/db.h>
#include <sys/wait.h>

#include <fstream>
#include <limits>
#include <thread>

#include "damage.h"
#include "samples.h"

namespace veduta {
namespace {

TEST(Database, NewDatabaseIsEmpty) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  const auto snapshot = database->GetSnapshot();
  EXPECT_EQ(*snapshot->GetState(), DatabaseState{});
  EXPECT_TRUE(snapshot->ListCameras()->empty());
  EXPECT_TRUE(snapshot->ListReconstructions()->empty());
  EXPECT_TRUE(snapshot->ListNeighbors(ImageId(1))->empty());
  EXPECT_TRUE(snapshot->GetObservations(ImageId(1))->empty());
  EXPECT_FALSE(snapshot->FindImageByName("a", "anna")->has_value());
  EXPECT_FALSE(snapshot->FindPose(ImageId(1))->has_value());
  const auto block = snapshot->GetPointBlock(ReconstructionId(1), 1, ImageId(7));
  ASSERT_OK(block);
  EXPECT_EQ(block->home, ImageId(7));
  EXPECT_EQ(block->next_ordinal, 1u);
  const Status missing = snapshot->GetImage(ImageId(31)).status();
  EXPECT_EQ(missing.code(), StatusCode::kNotFound);
  EXPECT_NE(missing.message().find("31"), std::string::npos) << missing.message();
  EXPECT_EQ(snapshot->GetPair(ImageId(2), ImageId(1)).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->GetPhoto(SampleHash(1)).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->GetVocabulary(1).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->GetWords(1, ImageId(1)).status().code(), StatusCode::kNotFound);
}

void PutEverything(Database& database) {
  SeededRandom random(5);
  ASSERT_OK(
      database.WritePhotoAhead(SampleHash(1), SampleBytes(1, 100'000), SampleFeatures(1, 300)));
  ASSERT_OK(database.WriteVocabularyAhead(1, SampleBytes(3, 5000)));
  auto transaction = database.BeginTransaction();
  DatabaseState state = SampleState(3);
  state.vocabulary_generation = 1;
  transaction->PutState(state);
  transaction->PutCamera({CameraId(2), "second", {}, "x"});
  transaction->PutCamera({CameraId(1), "first", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, "y"});
  transaction->PutImage(SampleImage(1));
  transaction->PutImage(SampleImage(2));
  transaction->PutPair(SamplePair(1, 2, 40));
  transaction->PutPair(SamplePair(2, 300, 50));
  transaction->PutPair(SamplePair(2, 256, 60));
  transaction->PutReconstruction(SampleReconstruction(1, 4));
  transaction->PutPose({ImageId(2), ReconstructionId(1), SampleRigid(&random)});
  transaction->PutObservations(ImageId(2), std::vector<Observation>{{3, {ImageId(1), 2}}});
  transaction->PutPointBlock(ReconstructionId(1), 4, SampleBlock(2, 10));
  transaction->PutPointBlock(ReconstructionId(1), 4, SampleBlock(1, 20));
  transaction->PutPointBlock(ReconstructionId(1), 3, SampleBlock(1, 5));
  transaction->PutWords(1, ImageId(2), std::vector<WordId>{4, 9});
  transaction->AddPostings(1, std::vector<WordId>{4, 9}, ImageId(2));
  transaction->AddJournal({1, 10, "anna", "add", ImageId(1), {}, "one"});
  transaction->AddJournal({2, 20, "anna", "add", ImageId(2), {}, "two"});
  transaction->AddJournal({256, 30, "veduta", "adjust", {}, ReconstructionId(1), "three"});
  EXPECT_GT(transaction->size_bytes(), 1000u);
  ASSERT_OK(transaction->Commit());
}

void ExpectEverything(const Database& database) {
  const auto snapshot = database.GetSnapshot();
  EXPECT_EQ(snapshot->GetState()->next_image, 3u);
  const auto cameras = snapshot->ListCameras();
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 2u);
  EXPECT_EQ((*cameras)[0].name, "first");
  EXPECT_EQ(snapshot->GetCamera(CameraId(2))->name, "second");
  EXPECT_EQ(snapshot->GetImage(ImageId(2))->name, SampleImage(2).name);
  EXPECT_EQ(**snapshot->FindImageByName(SampleImage(2).name, "anna"), ImageId(2));
  EXPECT_EQ(**snapshot->FindImageByPhoto(SampleHash(1)), ImageId(1));
  std::vector<uint32_t> images;
  EXPECT_OK(snapshot->ScanImages(
      [&](const ImageRecord& image) { return images.push_back(image.id.value), true; }));
  EXPECT_EQ(images, (std::vector<uint32_t>{1, 2}));
  images.clear();
  EXPECT_OK(snapshot->ScanImages(
      [&](const ImageRecord& image) { return images.push_back(image.id.value), false; }));
  EXPECT_EQ(images, (std::vector<uint32_t>{1})) << "a scan must stop when it is told to";
  const auto photo = snapshot->GetPhoto(SampleHash(1));
  ASSERT_OK(photo);
  EXPECT_EQ(std::vector<uint8_t>(photo->bytes().begin(), photo->bytes().end()),
            SampleBytes(1, 100'000));
  EXPECT_EQ(snapshot->GetFeatures(SampleHash(1))->keypoints, SampleFeatures(1, 300).keypoints);
  EXPECT_EQ(snapshot->GetPair(ImageId(300), ImageId(2))->matches, SamplePair(2, 300, 50).matches);
  const auto neighbors = snapshot->ListNeighbors(ImageId(2));
  ASSERT_OK(neighbors);
  ASSERT_EQ(neighbors->size(), 3u);
  EXPECT_EQ((*neighbors)[0].image, ImageId(1));
  EXPECT_EQ((*neighbors)[0].match_count, 40u);
  EXPECT_EQ((*neighbors)[1].image, ImageId(256));
  EXPECT_EQ((*neighbors)[2].image, ImageId(300));
  EXPECT_EQ((*neighbors)[2].geometry, PairGeometry::kPlanar);
  EXPECT_EQ(snapshot->ListNeighbors(ImageId(300))->at(0).image, ImageId(2));
  EXPECT_EQ(snapshot->GetReconstruction(ReconstructionId(1))->points_generation, 4u);
  EXPECT_EQ(snapshot->ListReconstructions()->size(), 1u);
  EXPECT_EQ((*snapshot->FindPose(ImageId(2)))->reconstruction, ReconstructionId(1));
  EXPECT_EQ(snapshot->GetObservations(ImageId(2))->size(), 1u);
  EXPECT_EQ(snapshot->GetPointBlock(ReconstructionId(1), 4, ImageId(1))->points.size(), 20u);
  std::vector<size_t> sizes;
  EXPECT_OK(snapshot->ScanPointBlocks(ReconstructionId(1), 4, [&](const PointBlock& block) {
    return sizes.push_back(block.points.size()), true;
  }));
  EXPECT_EQ(sizes, (std::vector<size_t>{20, 10}));
  EXPECT_EQ(snapshot->GetVocabulary(1)->bytes().size(), 5000u);
  EXPECT_EQ(*snapshot->GetWords(1, ImageId(2)), (std::vector<WordId>{4, 9}));
  std::vector<std::string> details;
  EXPECT_OK(snapshot->ScanJournal(
      2, [&](const JournalRecord& record) { return details.push_back(record.detail), true; }));
  EXPECT_EQ(details, (std::vector<std::string>{"two", "three"}));
}

TEST(Database, EveryRecordOutlivesReopening) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PutEverything(*database);
  ExpectEverything(*database);
  database.reset();
  database = MustOpen(folder / "db", {});
  ExpectEverything(*database);
  ASSERT_OK(database->Compact());
  ExpectEverything(*database);
  database.reset();
  database = MustOpen(folder / "db", {.read_only = true});
  ExpectEverything(*database);
}

TEST(Database, SnapshotKeepsTheFilesOpenAndResultsDoNot) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PutEverything(*database);
  auto snapshot = database->GetSnapshot();
  const auto in_memory = snapshot->GetPhoto(SampleHash(1));
  ASSERT_OK(database->Compact());
  const auto in_a_file = snapshot->GetPhoto(SampleHash(1));
  database.reset();
  EXPECT_EQ(snapshot->GetState()->next_image, 3u);
  EXPECT_EQ(Database::Open(folder / "db", {}).status().code(), StatusCode::kBusy);
  snapshot.reset();
  EXPECT_NE(MustOpen(folder / "db", {}), nullptr);
  for (const auto& photo : {&in_memory, &in_a_file}) {
    ASSERT_OK(*photo);
    const std::span<const uint8_t> bytes = (*photo)->bytes();
    EXPECT_EQ(std::vector<uint8_t>(bytes.begin(), bytes.end()), SampleBytes(1, 100'000));
  }
}

TEST(Database, DamagedValueNamesFamilyAndKey) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PutEverything(*database);
  database.reset();
  WithRocksdb(
      folder / "db",
      [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* images) {
        ASSERT_TRUE(db.Put(rocksdb::WriteOptions(), images, ImageKey(ImageId(2)),
                           rocksdb::Slice("not a message"))
                        .ok());
      },
      Family::kImages);
  database = MustOpen(folder / "db", {});
  const auto snapshot = database->GetSnapshot();
  EXPECT_OK(snapshot->GetImage(ImageId(1)));
  for (const Status& status : {snapshot->GetImage(ImageId(2)).status(),
                               snapshot->ScanImages([](const ImageRecord&) { return true; })}) {
    EXPECT_EQ(status.code(), StatusCode::kCorruption);
    EXPECT_NE(status.message().find("family images"), std::string::npos) << status.message();
    EXPECT_NE(status.message().find("0x00000002"), std::string::npos) << status.message();
  }
}

TEST(Database, FlippedByteInAFileIsCorruption) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PutEverything(*database);
  ASSERT_OK(database->Compact());
  database.reset();
  // In the middle of the one blob file that holds the photo.
  size_t flipped = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "db")) {
    if (entry.path().extension() != ".blob" || entry.file_size() < 100'000) continue;
    std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(50'000);
    file.put('\x55');
    file.seekp(50'001);
    file.put('\xAA');
    ++flipped;
  }
  ASSERT_EQ(flipped, 1u);
  database = MustOpen(folder / "db", {});
  const Status photo = database->GetSnapshot()->GetPhoto(SampleHash(1)).status();
  EXPECT_EQ(photo.code(), StatusCode::kCorruption) << photo.message();
  EXPECT_NE(photo.message().find("photos"), std::string::npos) << photo.message();
}

TEST(Database, SnapshotsDoNotSeeLaterWrites) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  const auto before = database->GetSnapshot();
  PutEverything(*database);
  const auto between = database->GetSnapshot();
  auto transaction = database->BeginTransaction();
  transaction->PutState(SampleState(99));
  transaction->DeletePointBlocks(ReconstructionId(1), 4);
  transaction->AddPostings(1, std::vector<WordId>{4}, ImageId(7));
  EXPECT_EQ(database->GetSnapshot()->GetState()->next_image, 3u)
      << "nothing is visible before Commit";
  ASSERT_OK(transaction->Commit());
  ASSERT_OK(database->Compact());
  EXPECT_EQ(*before->GetState(), DatabaseState{});
  EXPECT_FALSE(before->FindImageByName(SampleImage(1).name, "anna")->has_value());
  EXPECT_EQ(between->GetState()->next_image, 3u);
  EXPECT_EQ(between->GetPointBlock(ReconstructionId(1), 4, ImageId(1))->points.size(), 20u);
  EXPECT_EQ(between->GetPostings(1, std::vector<WordId>{4})->at(0),
            (std::vector<ImageId>{ImageId(2)}));
  size_t photos = 0;
  EXPECT_OK(before->ScanPhotoKeys([&](const ContentHash&) { return ++photos, true; }));
  EXPECT_EQ(photos, 0u);
  const auto after = database->GetSnapshot();
  EXPECT_EQ(after->GetState()->next_image, 99u);
  EXPECT_EQ(after->GetPointBlock(ReconstructionId(1), 4, ImageId(1))->points.size(), 0u);
  EXPECT_EQ(after->GetPointBlock(ReconstructionId(1), 3, ImageId(1))->points.size(), 5u)
      << "another generation";
  EXPECT_EQ(after->GetPostings(1, std::vector<WordId>{4})->at(0),
            (std::vector<ImageId>{ImageId(2), ImageId(7)}));
}

TEST(Database, ConflictOnTheStateIsBusy) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto first = database->BeginTransaction();
  auto second = database->BeginTransaction();
  first->PutState(SampleState(2));
  first->PutImage(SampleImage(1));
  second->PutState(SampleState(3));
  second->PutImage(SampleImage(2));
  ASSERT_OK(first->Commit());
  EXPECT_EQ(second->Commit().code(), StatusCode::kBusy);
  EXPECT_EQ(second->Commit().code(), StatusCode::kInvalidArgument) << "it is spent";
  EXPECT_EQ(database->GetSnapshot()->GetState()->next_image, 2u);
  EXPECT_FALSE(database->GetSnapshot()->FindImageByName(SampleImage(2).name, "anna")->has_value());
  // Without a change of the state there is no conflict.
  auto third = database->BeginTransaction();
  auto fourth = database->BeginTransaction();
  third->AddJournal({1, 0, "a", "b", {}, {}, ""});
  ASSERT_OK(third->Commit());
  fourth->PutState(SampleState(4));
  EXPECT_OK(fourth->Commit());
}

TEST(Database, BrokenRecordFailsTheWholeTransaction) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutImage(SampleImage(1));
  PoseRecord pose{ImageId(1), ReconstructionId(1), Rigid3()};
  pose.cam_from_world.translation.x() = std::numeric_limits<double>::quiet_NaN();
  transaction->PutPose(pose);
  const Status status = transaction->Commit();
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("poses"), std::string::npos) << status.message();
  EXPECT_FALSE(database->GetSnapshot()->FindImageByName(SampleImage(1).name, "anna")->has_value());
  auto next = database->BeginTransaction();
  next->PutImage(SampleImage(1));
  EXPECT_OK(next->Commit()) << "the database itself is well";
}

TEST(Database, RejectedImagesAreNotFoundByPhoto) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutImage(SampleImage(1));
  ImageRecord rejected = SampleImage(2);
  rejected.verdict = Verdict::kRejected;
  rejected.reason = Reason::kNoTexture;
  transaction->PutImage(rejected);
  ImageRecord name_taken = SampleImage(3);
  name_taken.name = SampleImage(1).name;
  name_taken.verdict = Verdict::kRejected;
  name_taken.reason = Reason::kNameTaken;
  transaction->PutImage(name_taken);
  ASSERT_OK(transaction->Commit());
  const auto snapshot = database->GetSnapshot();
  EXPECT_EQ(**snapshot->FindImageByName(rejected.name, "anna"), ImageId(2));
  EXPECT_FALSE(snapshot->FindImageByPhoto(rejected.photo)->has_value());
  EXPECT_EQ(**snapshot->FindImageByName(SampleImage(1).name, "anna"), ImageId(1))
      << "the name stays with its first owner";
  EXPECT_OK(snapshot->GetImage(ImageId(3)));
}

TEST(Database, EmptyRecordsAreDeletions) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PutEverything(*database);
  auto transaction = database->BeginTransaction();
  transaction->PutObservations(ImageId(2), {});
  PointBlock empty;
  empty.home = ImageId(1);
  transaction->PutPointBlock(ReconstructionId(1), 4, empty);
  PointBlock emptied;
  emptied.home = ImageId(2);
  emptied.next_ordinal = 21;
  transaction->PutPointBlock(ReconstructionId(1), 4, emptied);
  ASSERT_OK(transaction->Commit());
  const auto snapshot = database->GetSnapshot();
  EXPECT_TRUE(snapshot->GetObservations(ImageId(2))->empty());
  EXPECT_EQ(snapshot->GetPointBlock(ReconstructionId(1), 4, ImageId(2))->next_ordinal, 21u)
      << "ordinals are never used again";
  size_t blocks = 0;
  EXPECT_OK(snapshot->ScanPointBlocks(ReconstructionId(1), 4,
                                      [&](const PointBlock&) { return ++blocks, true; }));
  EXPECT_EQ(blocks, 1u);
}

TEST(Database, DeleteVocabularyTakesOneGeneration) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (const uint32_t generation : {1u, 2u, 0xFFFFFFFFu}) {
    ASSERT_OK(database->WriteVocabularyAhead(generation, SampleBytes(1, 100)));
    ASSERT_OK(database->WriteWordsAhead(generation, ImageId(0xFFFFFFFF),
                                        std::vector<WordId>{1, 0xFFFFFFFF}));
    ASSERT_OK(
        database->WritePostingsAhead(generation, 0xFFFFFFFF, std::vector<ImageId>{ImageId(5)}));
  }
  for (const uint32_t generation : {1u, 0xFFFFFFFFu}) {
    auto transaction = database->BeginTransaction();
    transaction->DeleteVocabulary(generation);
    ASSERT_OK(transaction->Commit());
    const auto snapshot = database->GetSnapshot();
    EXPECT_EQ(snapshot->GetVocabulary(generation).status().code(), StatusCode::kNotFound);
    EXPECT_EQ(snapshot->GetWords(generation, ImageId(0xFFFFFFFF)).status().code(),
              StatusCode::kNotFound);
    EXPECT_TRUE(snapshot->GetPostings(generation, std::vector<WordId>{0xFFFFFFFF})->at(0).empty());
    EXPECT_OK(snapshot->GetVocabulary(2));
    EXPECT_OK(snapshot->GetWords(2, ImageId(0xFFFFFFFF)));
  }
}

TEST(Database, CheckpointIsADatabaseOfItsOwn) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PutEverything(*database);
  ASSERT_OK(database->CreateCheckpoint(folder / "copy"));
  EXPECT_EQ(database->CreateCheckpoint(folder / "copy").code(), StatusCode::kAlreadyExists);
  ASSERT_OK(database->CheckCheckpoint(folder / "copy"));
  auto transaction = database->BeginTransaction();
  transaction->PutState(SampleState(50));
  ASSERT_OK(transaction->Commit());
  ASSERT_OK(database->Compact());
  auto copy = MustOpen(folder / "copy", {});
  ExpectEverything(*copy);
  auto in_copy = copy->BeginTransaction();
  in_copy->PutState(SampleState(60));
  ASSERT_OK(in_copy->Commit());
  EXPECT_EQ(database->GetSnapshot()->GetState()->next_image, 50u);
}

TEST(Database, SizesCountPhotosAndFeatures) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(
      database->WritePhotoAhead(SampleHash(1), SampleBytes(1, 1'000'000), SampleFeatures(1, 1000)));
  for (const bool compacted : {false, true}) {
    if (compacted) {
      ASSERT_OK(database->Compact());
    }
    const auto sizes = database->GetSizes();
    ASSERT_OK(sizes);
    EXPECT_GT(sizes->photo_bytes, 1'000'000u) << compacted;
    EXPECT_LT(sizes->photo_bytes, compacted ? 1'100'000u : 2'200'000u);
    EXPECT_GT(sizes->feature_bytes, 152'000u) << compacted;
    // A memtable takes memory by the MiB.
    EXPECT_LT(sizes->feature_bytes, compacted ? 300'000u : 1'300'000u);
    EXPECT_GT(sizes->total_bytes, 1'152'000u) << compacted;
  }
}

TEST(Database, ReadOnlyWritesNothing) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PutEverything(*database);
  database.reset();
  const auto list = [&] {
    std::map<std::string, uintmax_t> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "db"))
      files[entry.path().filename()] = entry.file_size();
    return files;
  };
  const auto before = list();
  database = MustOpen(folder / "db", {.read_only = true});
  auto transaction = database->BeginTransaction();
  transaction->PutImage(SampleImage(5));
  EXPECT_EQ(transaction->Commit().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(database->WritePhotoAhead(SampleHash(9), SampleBytes(9, 10), Features()).code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(database->Compact().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(database->CreateCheckpoint(folder / "copy").code(), StatusCode::kInvalidArgument);
  EXPECT_OK(database->GetSizes());
  database.reset();
  EXPECT_EQ(list(), before);
  EXPECT_EQ(Database::Open(folder / "new", {.create = true, .read_only = true}).status().code(),
            StatusCode::kInvalidArgument);
}

TEST(Database, ReadersAndAWriterAtOnce) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db", {.sync_wal = false});
  std::atomic<bool> stop = false;
  std::vector<std::thread> readers;
  std::atomic<size_t> reads = 0;
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&] {
      do {
        // In every snapshot the counter, the images and the journal must agree.
        const auto snapshot = database->GetSnapshot();
        const uint32_t next = snapshot->GetState()->next_image;
        uint32_t images = 0, entries = 0;
        EXPECT_OK(snapshot->ScanImages([&](const ImageRecord&) { return ++images, true; }));
        EXPECT_OK(snapshot->ScanJournal(0, [&](const JournalRecord&) { return ++entries, true; }));
        EXPECT_EQ(images, next - 1);
        EXPECT_EQ(entries, next - 1);
        ++reads;
      } while (!stop);
    });
  }
  for (uint32_t id = 1; id <= 150; ++id) {
    auto transaction = database->BeginTransaction();
    transaction->PutImage(SampleImage(id));
    transaction->AddJournal({id, 0, "a", "add", ImageId(id), {}, ""});
    DatabaseState state;
    state.next_image = id + 1;
    transaction->PutState(state);
    ASSERT_OK(transaction->Commit());
  }
  stop = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_GE(reads.load(), readers.size());
}

}  // namespace
}  // namespace veduta
