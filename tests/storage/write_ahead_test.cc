// SPDX-License-Identifier: Apache-2.0
// Goal: what was written ahead of a commit stays if the commit came, and is gone after the next
//   Open if it did not.
// Method: photos, point blocks and vocabularies written ahead, some named by a commit, then
//   closing and opening.
#include <gtest/gtest.h>

#include <set>

#include "samples.h"
#include "storage/database.h"
#include "storage/database_files.h"
#include "storage/records/photo_record.h"
#include "storage/value_reader.h"
#include "storage/write_ahead.h"
#include "storage/write_buffer.h"
#include "storage/written_ahead.h"

namespace veduta {
namespace {

std::set<ContentHash> PhotoKeys(const Database& database) {
  std::set<ContentHash> keys;
  EXPECT_OK(database.GetSnapshot()->ScanPhotoKeys(
      [&](const ContentHash& key) { return keys.insert(key).second; }));
  return keys;
}
std::set<ContentHash> FeatureKeys(const Database& database) {
  std::set<ContentHash> keys;
  EXPECT_OK(database.GetSnapshot()->ScanFeatureKeys(
      [&](const ContentHash& key) { return keys.insert(key).second; }));
  return keys;
}

Status WritePhoto(Database& database, uint32_t seed) {
  return database.WritePhotoAhead(SampleHash(seed), SampleBytes(seed, 3000),
                                  SampleFeatures(seed, 20));
}

void CommitImage(Database& database, const ImageRecord& image) {
  auto transaction = database.BeginTransaction();
  transaction->PutImage(image);
  ASSERT_OK(transaction->Commit());
}

size_t CountBlocks(const Database& database, uint32_t reconstruction, uint32_t generation) {
  size_t count = 0;
  EXPECT_OK(
      database.GetSnapshot()->ScanPointBlocks(ReconstructionId(reconstruction), generation,
                                              [&](const PointBlock&) { return ++count, true; }));
  return count;
}

TEST(WriteAhead, UncommittedPhotosAreSwept) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t seed = 1; seed <= 100; ++seed) ASSERT_OK(WritePhoto(*database, seed));
  std::set<ContentHash> kept;
  for (uint32_t id = 3; id <= 100; id += 7) {
    CommitImage(*database, SampleImage(id));
    kept.insert(SampleHash(id));
  }
  EXPECT_EQ(PhotoKeys(*database).size(), 100u);
  ASSERT_OK(database->Compact());
  EXPECT_EQ(PhotoKeys(*database).size(), 100u) << "keys are listed from blob files, too";
  database.reset();
  {
    const auto reader = MustOpen(folder / "db", {.read_only = true});
    EXPECT_EQ(PhotoKeys(*reader).size(), 100u) << "a reader sweeps nothing";
  }
  for (int round = 0; round < 2; ++round) {
    database = MustOpen(folder / "db", {});
    EXPECT_EQ(PhotoKeys(*database), kept) << round;
    EXPECT_EQ(FeatureKeys(*database), kept) << round;
    EXPECT_OK(database->GetSnapshot()->GetPhoto(SampleHash(3)));
    EXPECT_OK(database->GetSnapshot()->GetFeatures(SampleHash(3)));
    ASSERT_OK(database->Compact());
    EXPECT_EQ(PhotoKeys(*database), kept) << round;
    database.reset();
  }
}

TEST(WriteAhead, KeysAreListedWithManyVersionsOfOne) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  const auto empty = database->GetSnapshot();  // keeps every version alive
  for (uint32_t round = 0; round < 90; ++round) ASSERT_OK(WritePhoto(*database, 1));
  ASSERT_OK(WritePhoto(*database, 2));
  ASSERT_OK(WritePhoto(*database, 3));
  EXPECT_EQ(PhotoKeys(*database),
            (std::set<ContentHash>{SampleHash(1), SampleHash(2), SampleHash(3)}));
  size_t count = 0;
  ASSERT_OK(empty->ScanPhotoKeys([&](const ContentHash&) { return ++count, true; }));
  EXPECT_EQ(count, 0u);
  ASSERT_OK(
      database->GetSnapshot()->ScanPhotoKeys([&](const ContentHash&) { return ++count < 2; }));
  EXPECT_EQ(count, 2u) << "the scan must stop when it is told to";
}

TEST(WriteAhead, WritingTwiceAndAfterTheCommitChangesNothing) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(WritePhoto(*database, 1));
  ASSERT_OK(WritePhoto(*database, 1));
  CommitImage(*database, SampleImage(1));
  ASSERT_OK(WritePhoto(*database, 1));
  database.reset();
  database = MustOpen(folder / "db", {});
  EXPECT_EQ(PhotoKeys(*database), (std::set<ContentHash>{SampleHash(1)}));
}

TEST(WriteAhead, DroppingTakesUncommittedPhotosOnly) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t seed = 1; seed <= 3; ++seed) ASSERT_OK(WritePhoto(*database, seed));
  CommitImage(*database, SampleImage(1));
  ASSERT_OK(database->DropPhotoAhead(SampleHash(1)));  // a duplicate of what is committed
  ASSERT_OK(database->DropPhotoAhead(SampleHash(2)));
  ASSERT_OK(database->DropPhotoAhead(SampleHash(9)));  // never written
  EXPECT_EQ(PhotoKeys(*database), (std::set<ContentHash>{SampleHash(1), SampleHash(3)}));
  EXPECT_EQ(FeatureKeys(*database), PhotoKeys(*database));
}

TEST(WriteAhead, DroppingOneOfTwoClaimsKeepsThePhoto) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(WritePhoto(*database, 1));  // the same bytes under two names, both on their way
  ASSERT_OK(WritePhoto(*database, 1));
  ASSERT_OK(database->DropPhotoAhead(SampleHash(1)));
  EXPECT_EQ(PhotoKeys(*database).size(), 1u);
  ASSERT_OK(database->DropPhotoAhead(SampleHash(1)));
  EXPECT_EQ(PhotoKeys(*database).size(), 0u);
}

// The same bytes under a wrong camera, or under a name that is taken: such an image keeps nothing.
ImageRecord RejectedImage(uint32_t id, uint32_t photo_seed, Reason reason) {
  ImageRecord image = SampleImage(id);
  image.photo = SampleHash(photo_seed);
  image.verdict = Verdict::kRejected;
  image.reason = reason;
  return image;
}

TEST(WriteAhead, RejectedImageLeavesTheMarkOfAnotherSubmission) {
  for (const Reason reason : {Reason::kWrongSize, Reason::kNameTaken}) {
    const TemporaryFolder folder;
    auto database = MustCreate(folder / "db");
    ASSERT_OK(WritePhoto(*database, 1));
    CommitImage(*database, RejectedImage(7, 1, reason));
    EXPECT_TRUE(*database->GetSnapshot()->IsWrittenAhead(SampleHash(1)));
    // A kill, before the other submission's commit.
    database.reset();
    database = MustOpen(folder / "db", {});
    EXPECT_TRUE(PhotoKeys(*database).empty());
    EXPECT_TRUE(FeatureKeys(*database).empty());
    // The other order, and a submission whose commit comes.
    ASSERT_OK(WritePhoto(*database, 1));
    CommitImage(*database, SampleImage(1));
    CommitImage(*database, RejectedImage(8, 1, reason));
    database.reset();
    database = MustOpen(folder / "db", {});
    EXPECT_EQ(PhotoKeys(*database), (std::set<ContentHash>{SampleHash(1)}));
    EXPECT_FALSE(*database->GetSnapshot()->IsWrittenAhead(SampleHash(1)));
  }
}

TEST(WriteAhead, ClaimsOfAPhotoThatWasLostAreCountedOn) {
  const TemporaryFolder folder;
  PhotoClaims claims;
  EXPECT_FALSE(claims.Add(SampleHash(1)));
  claims.LoseAllBut({});
  EXPECT_FALSE(claims.CheckKept(SampleHash(1)).ok());
  EXPECT_TRUE(claims.Add(SampleHash(1)));  // another submission writes it anew
  claims.NoteWritten(SampleHash(1));
  EXPECT_OK(claims.CheckKept(SampleHash(1)));
  EXPECT_FALSE(claims.Release(SampleHash(1))) << "the first one is dropped, the second counts on";
  EXPECT_TRUE(claims.Release(SampleHash(1)));
}

// A log may end between the two records of a photo.
TEST(WriteAhead, ClaimedPhotoWithoutItsFeaturesCountsAsLost) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  const auto opened = DatabaseFiles::Open(folder / "db", DatabaseOptions());
  ASSERT_OK(opened);
  const auto& files = *opened;
  PhotoClaims claims;
  ASSERT_OK(
      WritePhotoAhead(*files, claims, SampleHash(1), SampleBytes(1, 10), SampleFeatures(1, 2), {}));
  ASSERT_OK(SweepWriteAheads(*files, claims));
  EXPECT_OK(claims.CheckKept(SampleHash(1)));
  WriteBuffer loss(*files);
  loss.Delete(Family::kFeatures, HashKey(SampleHash(1)));
  ASSERT_OK(loss.Write(/*sync=*/false, "lose features"));
  ASSERT_OK(SweepWriteAheads(*files, claims));
  EXPECT_FALSE(claims.CheckKept(SampleHash(1)).ok());
  EXPECT_FALSE(*ValueReader(*files, nullptr).Has(Family::kPhotos, HashKey(SampleHash(1))));
}

TEST(WriteAhead, FeaturesAreThoseOfTheSubmissionThatIsKept) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  const auto of_first = std::make_shared<const Features>(SampleFeatures(1, 20));
  const auto of_second = std::make_shared<const Features>(SampleFeatures(2, 30));
  for (const bool first_is_kept : {true, false}) {
    const uint32_t seed = first_is_kept ? 1 : 2;
    const auto& kept = first_is_kept ? of_first : of_second;
    for (const auto& features :
         {of_first, of_second})  // two cameras, both submissions on their way
      ASSERT_OK(database->WritePhotoAhead(SampleHash(seed), SampleBytes(seed, 10), *features));
    auto transaction = database->BeginTransaction();
    transaction->PutImage(SampleImage(seed));
    transaction->KeepFeatures(SampleHash(seed), kept);
    ASSERT_OK(transaction->Commit());
    // The other one comes again, after the commit.
    ASSERT_OK(database->WritePhotoAhead(SampleHash(seed), SampleBytes(seed, 10),
                                        first_is_kept ? *of_second : *of_first));
    ASSERT_OK(database->DropPhotoAhead(SampleHash(seed)));
    EXPECT_EQ(database->GetSnapshot()->GetFeatures(SampleHash(seed))->size(), kept->size());
  }
}

TEST(WriteAhead, PhotoWrittenAfterItsCommitIsNotClaimed) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(WritePhoto(*database, 1));
  CommitImage(*database, SampleImage(1));
  ASSERT_OK(WritePhoto(*database, 1));
  EXPECT_FALSE(*database->GetSnapshot()->IsWrittenAhead(SampleHash(1))) << "no mark comes back";
}

TEST(WriteAhead, AbandonedCommitLeavesTheMark) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(WritePhoto(*database, 1));
  {
    auto transaction = database->BeginTransaction();
    transaction->PutImage(SampleImage(1));
  }
  database.reset();
  database = MustOpen(folder / "db", {});
  EXPECT_TRUE(PhotoKeys(*database).empty());
}

// Whatever its holder does not commit is gone without another opening.
TEST(WriteAhead, HolderGivesUpWhatIsNotCommitted) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (const uint32_t seed : {1u, 2u}) {
    ASSERT_OK(WritePhoto(*database, seed));
    WrittenAhead held;
    held = WrittenAhead::Photo(database.get(), SampleHash(seed));
    const WrittenAhead moved = std::move(held);
    EXPECT_EQ(PhotoKeys(*database).count(SampleHash(seed)), 1u);
    if (seed == 2) CommitImage(*database, SampleImage(2));
  }
  EXPECT_EQ(PhotoKeys(*database), (std::set<ContentHash>{SampleHash(2)}));
  for (const uint32_t generation : {1u, 2u}) {
    const auto held_tree = WrittenAhead::Vocabulary(database.get(), generation);
    const auto held_blocks =
        WrittenAhead::PointBlocks(database.get(), ReconstructionId(1), generation);
    ASSERT_OK(database->WriteVocabularyAhead(generation, SampleBytes(generation, 100)));
    ASSERT_OK(database->WritePointBlocksAhead(ReconstructionId(1), generation,
                                              std::vector{SampleBlock(1, 3)}));
    if (generation == 1) continue;
    auto transaction = database->BeginTransaction();
    DatabaseState state = SampleState(2);
    state.vocabulary_generation = 2;
    transaction->PutState(state);
    transaction->PutReconstruction(SampleReconstruction(1, 2));
    ASSERT_OK(transaction->Commit());
  }
  const auto snapshot = database->GetSnapshot();
  EXPECT_EQ(snapshot->GetVocabulary(1).status().code(), StatusCode::kNotFound);
  EXPECT_OK(snapshot->GetVocabulary(2));
  EXPECT_EQ(CountBlocks(*database, 1, 1), 0u);
  EXPECT_EQ(CountBlocks(*database, 1, 2), 1u);
}

TEST(WriteAhead, PointBlocksOfUnnamedGenerationsAreSwept) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  const std::vector<PointBlock> blocks = {SampleBlock(1, 3), SampleBlock(2, 4)};
  for (const uint32_t reconstruction : {1u, 2u, 3u}) {
    ASSERT_OK(database->WritePointBlocksAhead(ReconstructionId(reconstruction), 5, blocks));
    ASSERT_OK(database->WritePointBlocksAhead(ReconstructionId(reconstruction), 6,
                                              std::vector{SampleBlock(1, 3)}));
  }
  auto transaction = database->BeginTransaction();
  transaction->PutReconstruction(SampleReconstruction(1, 5));
  transaction->PutReconstruction(SampleReconstruction(2, 6));
  ASSERT_OK(transaction->Commit());
  // More of a generation that is current already: the mark is back, and must not cost the
  // generation.
  ASSERT_OK(
      database->WritePointBlocksAhead(ReconstructionId(1), 5, std::vector{SampleBlock(9, 1)}));
  database.reset();
  database = MustOpen(folder / "db", {});
  EXPECT_EQ(CountBlocks(*database, 1, 5), 3u);
  EXPECT_EQ(CountBlocks(*database, 1, 6), 0u);
  EXPECT_EQ(CountBlocks(*database, 2, 5), 0u);
  EXPECT_EQ(CountBlocks(*database, 2, 6), 1u);
  EXPECT_EQ(CountBlocks(*database, 3, 5), 0u) << "no record at all";
}

TEST(WriteAhead, UnnamedVocabulariesAreSwept) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (const uint32_t generation : {1u, 2u}) {
    ASSERT_OK(database->WriteVocabularyAhead(generation, SampleBytes(generation, 100)));
    ASSERT_OK(database->WriteWordsAhead(generation, ImageId(1), std::vector<WordId>{7}));
    ASSERT_OK(database->WritePostingsAhead(generation, 7, std::vector<ImageId>{ImageId(1)}));
  }
  ASSERT_OK(database->WriteWordsAhead(3, ImageId(1),
                                      std::vector<WordId>{7}));  // cut short before its tree
  auto transaction = database->BeginTransaction();
  DatabaseState state = SampleState(2);
  state.vocabulary_generation = 1;
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
  database.reset();
  database = MustOpen(folder / "db", {});
  const auto snapshot = database->GetSnapshot();
  EXPECT_OK(snapshot->GetVocabulary(1));
  EXPECT_OK(snapshot->GetWords(1, ImageId(1)));
  EXPECT_EQ(snapshot->GetPostings(1, std::vector<WordId>{7})->at(0).size(), 1u);
  EXPECT_EQ(snapshot->GetVocabulary(2).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->GetWords(2, ImageId(1)).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(snapshot->GetPostings(2, std::vector<WordId>{7})->at(0).empty());
  EXPECT_EQ(snapshot->GetWords(3, ImageId(1)).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
