// SPDX-License-Identifier: Apache-2.0
// Goal: RemoveImage leaves nothing of an image, and everything of the others; DeletePair, what
//   people forbid and hypotheses behave as Transaction says.
// Method: a small database in which images share pairs and words; every key of every family is
//   looked at for the removed id and hash.
#include "storage/transaction.h"

#include <gtest/gtest.h>

#include "samples.h"
#include "storage/records/photo_record.h"
#include "storage/records/vocabulary_record.h"
#include "stored_families.h"

namespace veduta {
namespace {

constexpr uint32_t kGeneration = 1;

std::vector<WordId> WordsOf(uint32_t id) {
  std::vector<WordId> words = {id, 100, 200 + id % 2};
  return words;
}

void AddImage(Database* database, uint32_t id) {
  ImageRecord image = SampleImage(id);
  ASSERT_OK(database->WritePhotoAhead(image.photo, SampleBytes(id, 500), SampleFeatures(id, 3)));
  auto transaction = database->BeginTransaction();
  transaction->PutImage(image);
  for (uint32_t other = 1; other < id; ++other) transaction->PutPair(SamplePair(other, id, 5));
  transaction->PutWords(kGeneration, image.id, WordsOf(id));
  transaction->AddPostings(kGeneration, WordsOf(id), image.id);
  DatabaseState state;
  state.next_image = id + 1;
  state.vocabulary_generation = kGeneration;
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
}

void RemoveImage(Database* database, uint32_t id) {
  auto transaction = database->BeginTransaction();
  transaction->RemoveImage(ImageId(id));
  ASSERT_OK(transaction->Commit());
}

TEST(Removal, TakesOutAllThatIsOfTheImageAlone) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t id = 1; id <= 4; ++id) AddImage(database.get(), id);
  RemoveImage(database.get(), 2);
  const auto snapshot = database->GetSnapshot();
  EXPECT_EQ(snapshot->GetImage(ImageId(2)).status().code(), StatusCode::kNotFound);
  EXPECT_FALSE((*snapshot->FindImageByName(SampleImage(2).name, "anna")).has_value());
  EXPECT_FALSE((*snapshot->FindImageByPhoto(SampleHash(2))).has_value());
  EXPECT_EQ(snapshot->GetPhoto(SampleHash(2)).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->GetFeatures(SampleHash(2)).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->GetWords(kGeneration, ImageId(2)).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(snapshot->ListNeighbors(ImageId(2))->empty());
  for (const uint32_t other : {1u, 3u, 4u}) {
    EXPECT_EQ(snapshot->GetPair(ImageId(other), ImageId(2)).status().code(), StatusCode::kNotFound);
    EXPECT_EQ(snapshot->ListNeighbors(ImageId(other))->size(), 2u);
    EXPECT_OK(snapshot->GetImage(ImageId(other)));
    EXPECT_OK(snapshot->GetPhoto(SampleHash(other)));
  }
  const std::vector<WordId> words = {2, 100, 200};
  const auto postings = snapshot->GetPostings(kGeneration, words);
  ASSERT_OK(postings);
  EXPECT_EQ(postings->at(0), std::vector<ImageId>());
  EXPECT_EQ(postings->at(1), (std::vector{ImageId(1), ImageId(3), ImageId(4)}));
  EXPECT_EQ(postings->at(2), std::vector{ImageId(4)});
  ASSERT_OK(snapshot->ScanPostings(kGeneration, [](WordId word, auto) {
    EXPECT_NE(word, 2u) << "no image has the word any more";
    return true;
  }));
  EXPECT_EQ(snapshot->GetCounts()->images, 3u);
}

TEST(Removal, NoKeyNamesTheImageAfterwards) {
  const TemporaryFolder folder;
  {
    auto database = MustCreate(folder / "db");
    for (uint32_t id = 1; id <= 3; ++id) AddImage(database.get(), id);
    RemoveImage(database.get(), 3);
  }
  const StoredFamilies stored(folder / "db");
  for (const Family family : {Family::kImages, Family::kNames, Family::kHashes, Family::kPhotos,
                              Family::kFeatures, Family::kWords})
    EXPECT_EQ(stored.Keys(family).size(), 2u) << FamilyName(family);
  EXPECT_EQ(stored.Keys(Family::kPairs).size(), 3u) << "one pair, and both its directions";
}

TEST(Removal, OfARejectedPhotoLeavesWhatOthersHave) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  AddImage(database.get(), 1);
  ImageRecord rejected = SampleImage(2);
  rejected.name = SampleImage(1).name;
  rejected.photo = SampleHash(1);
  rejected.verdict = Verdict::kRejected;
  rejected.reason = Reason::kNameTaken;
  auto transaction = database->BeginTransaction();
  transaction->PutImage(rejected);
  ASSERT_OK(transaction->Commit());
  RemoveImage(database.get(), 2);
  const auto snapshot = database->GetSnapshot();
  EXPECT_EQ(**snapshot->FindImageByName(SampleImage(1).name, "anna"), ImageId(1));
  EXPECT_EQ(**snapshot->FindImageByPhoto(SampleHash(1)), ImageId(1));
  EXPECT_OK(snapshot->GetPhoto(SampleHash(1)));
  EXPECT_EQ(snapshot->GetImage(ImageId(2)).status().code(), StatusCode::kNotFound);
}

TEST(Removal, OfAnImageThatIsNotThereAppliesNothing) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutCamera({CameraId(1), "c", {}, ""});
  transaction->RemoveImage(ImageId(9));
  EXPECT_EQ(transaction->Commit().code(), StatusCode::kNotFound);
  EXPECT_TRUE(database->GetSnapshot()->ListCameras()->empty());
}

TEST(Removal, ThePhotoMayComeAgainUnderAnotherId) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  AddImage(database.get(), 1);
  RemoveImage(database.get(), 1);
  ImageRecord again = SampleImage(2);
  again.name = SampleImage(1).name;
  again.photo = SampleHash(1);
  ASSERT_OK(database->WritePhotoAhead(again.photo, SampleBytes(1, 500), SampleFeatures(1, 3)));
  auto transaction = database->BeginTransaction();
  transaction->PutImage(again);
  transaction->AddPostings(kGeneration, WordsOf(1), again.id);
  ASSERT_OK(transaction->Commit());
  const auto snapshot = database->GetSnapshot();
  EXPECT_EQ(**snapshot->FindImageByPhoto(again.photo), again.id);
  EXPECT_EQ(snapshot->GetPostings(kGeneration, WordsOf(1))->at(0), std::vector{again.id});
}

TEST(Removal, APairIsDeletedInEitherOrder) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t id = 1; id <= 3; ++id) AddImage(database.get(), id);
  auto transaction = database->BeginTransaction();
  transaction->DeletePair(ImageId(3), ImageId(1));
  transaction->DeletePair(ImageId(1), ImageId(7));  // there is none
  ASSERT_OK(transaction->Commit());
  const auto snapshot = database->GetSnapshot();
  EXPECT_EQ(snapshot->GetPair(ImageId(1), ImageId(3)).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->ListNeighbors(ImageId(1))->size(), 1u);
  EXPECT_EQ(snapshot->ListNeighbors(ImageId(3))->size(), 1u);
  EXPECT_EQ(snapshot->ListNeighbors(ImageId(2))->size(), 2u);
}

TEST(Forbidden, IsStoredUntilItIsTakenBack) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutForbidden({ForbiddenKind::kMerge, 1, 4, 9, "anna", "other side of the river"});
  transaction->PutForbidden({ForbiddenKind::kPair, 2, 300, 8, "ben", ""});
  ASSERT_OK(transaction->Commit());
  database.reset();
  database = MustOpen(folder / "db", {});
  const auto all = database->GetSnapshot()->ListForbidden();
  ASSERT_OK(all);
  ASSERT_EQ(all->size(), 2u);
  EXPECT_EQ(all->at(0).kind, ForbiddenKind::kPair);
  EXPECT_EQ(all->at(0).b, 300u);
  EXPECT_EQ(all->at(1).actor, "anna");
  EXPECT_EQ(all->at(1).reason, "other side of the river");
  const auto snapshot = database->GetSnapshot();
  EXPECT_TRUE(*snapshot->IsForbidden(ForbiddenKind::kPair, 300, 2));
  EXPECT_FALSE(*snapshot->IsForbidden(ForbiddenKind::kMerge, 2, 300));
  EXPECT_TRUE(*snapshot->IsForbidden(ForbiddenKind::kMerge, 1, 4));
  transaction = database->BeginTransaction();
  transaction->DeleteForbidden(ForbiddenKind::kPair, 300, 2);
  ASSERT_OK(transaction->Commit());
  EXPECT_FALSE(*database->GetSnapshot()->IsForbidden(ForbiddenKind::kPair, 2, 300));
  EXPECT_EQ(database->GetSnapshot()->ListForbidden()->size(), 1u);
}

TEST(Forbidden, OneOfAThingWithItselfIsRefused) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutForbidden({ForbiddenKind::kPair, 3, 3, 0, "", ""});
  EXPECT_EQ(transaction->Commit().code(), StatusCode::kInvalidArgument);
}

TEST(Hypotheses, AreReplacedByTheirTwoAndDeletedInEitherOrder) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  HypothesisRecord first, second;
  first.a = ReconstructionId(2), first.b = ReconstructionId(9);
  first.images = {ImageId(4)};
  second = first;
  second.b = ReconstructionId(300);
  auto transaction = database->BeginTransaction();
  transaction->PutHypothesis(second);
  transaction->PutHypothesis(first);
  first.judgment_count = 2;
  transaction->PutHypothesis(first);
  ASSERT_OK(transaction->Commit());
  database.reset();
  database = MustOpen(folder / "db", {});
  const auto all = database->GetSnapshot()->ListHypotheses();
  ASSERT_OK(all);
  ASSERT_EQ(all->size(), 2u);
  EXPECT_EQ(all->at(0).b, first.b);
  EXPECT_EQ(all->at(0).judgment_count, 2u);
  EXPECT_EQ(all->at(1).b, second.b);
  EXPECT_TRUE(database->GetSnapshot()->ListForbidden()->empty());
  transaction = database->BeginTransaction();
  transaction->DeleteHypothesis(first.b, first.a);
  transaction->DeleteHypothesis(ReconstructionId(5), ReconstructionId(6));  // there is none
  ASSERT_OK(transaction->Commit());
  ASSERT_EQ(database->GetSnapshot()->ListHypotheses()->size(), 1u);
  EXPECT_EQ(database->GetSnapshot()->ListHypotheses()->at(0).b, second.b);
}

}  // namespace
}  // namespace veduta
