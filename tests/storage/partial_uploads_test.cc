// SPDX-License-Identifier: Apache-2.0
// Goal: a photo that arrives in parts is there as far as it has come, over closing and opening, in
//   few pieces however small its parts are; with its last part it is in line, in the same write.
// Method: parts of seeded sizes, in a database that is closed and opened between.
#include "storage/partial_uploads.h"

#include <gtest/gtest.h>

#include "samples.h"
#include "storage/contributing_view.h"
#include "storage/database.h"

namespace veduta {
namespace {

PartialUploadRecord Sample(uint8_t seed, uint64_t length) {
  PartialUploadRecord partial;
  partial.id.fill(seed);
  partial.name = std::to_string(seed) + ".jpg";
  partial.contributor = "anna";
  partial.length_bytes = length;
  return partial;
}

PartialUploadRecord Stored(const Database& database, const PartialUploadId& id) {
  const auto found = database.GetSnapshot()->contributing().FindPartialUpload(id);
  EXPECT_OK(found);
  EXPECT_TRUE(*found);
  return **found;
}

std::vector<uint8_t> Bytes(const Database& database, const PartialUploadRecord& partial) {
  const auto bytes = database.GetSnapshot()->contributing().GetPieces(partial);
  EXPECT_OK(bytes);
  return bytes.ok() ? *bytes : std::vector<uint8_t>();
}

TEST(PartialUploads, GrowPartByPartOverClosing) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  const std::vector<uint8_t> photo = SampleBytes(1, 2'000'000);
  PartialUploadRecord partial = Sample(1, photo.size() + 1);
  ASSERT_OK(database->PutPartialUpload(partial));
  SeededRandom random(2);
  size_t offset = 0;
  while (offset < photo.size()) {
    const size_t part = std::min<size_t>(1 + random.Below(60'000), photo.size() - offset);
    ASSERT_OK(database->AppendToPartialUpload(std::span(photo).subspan(offset, part), &partial));
    offset += part;
    if (random.Below(8) == 0) {
      database.reset();
      database = MustOpen(folder / "db", {});
      partial = Stored(*database, partial.id);
    }
    ASSERT_EQ(partial.received_bytes, offset);
  }
  EXPECT_EQ(Bytes(*database, partial), photo);
  EXPECT_LE(partial.piece_count, photo.size() / (256 << 10) + 1);
}

TEST(PartialUploads, GetInLineWithTheLastPart) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  const std::vector<uint8_t> photo = SampleBytes(1, 1'000);
  PartialUploadRecord partial = Sample(1, photo.size()), other = Sample(2, 50);
  ASSERT_OK(database->PutPartialUpload(partial));
  ASSERT_OK(database->PutPartialUpload(other));
  ASSERT_OK(database->AppendToPartialUpload(std::span(photo).first(900), &partial));
  ASSERT_OK(database->AppendToPartialUpload(std::span(photo).first(20), &other));
  UploadRecord upload;
  upload.name = partial.name;
  upload.photo = HashContent(photo);
  upload.size_bytes = photo.size();
  ASSERT_OK(database->FinishPartialUpload(photo, &upload, &partial));
  EXPECT_EQ(upload.number, 1u);
  database.reset();
  database = MustOpen(folder / "db", {});
  const PartialUploadRecord stored = Stored(*database, partial.id);
  EXPECT_EQ(stored.upload, 1u);
  EXPECT_EQ(stored.received_bytes, photo.size());
  EXPECT_EQ(stored.piece_count, 0u);
  const auto snapshot = database->GetSnapshot();
  EXPECT_TRUE(std::ranges::equal(snapshot->GetUploadBytes(1)->bytes(), photo));
  EXPECT_EQ(snapshot->contributing().ListPartialUploads()->size(), 1u);
  EXPECT_EQ(snapshot->contributing().ListPartialUploads(true)->size(), 1u);
  EXPECT_EQ(Bytes(*database, Stored(*database, other.id)).size(), 20u);
  ASSERT_OK(database->DeletePartialUpload(other));
  EXPECT_FALSE(*database->GetSnapshot()->contributing().FindPartialUpload(other.id));
  EXPECT_EQ(database->GetSnapshot()->contributing().GetPieces(other).status().code(),
            StatusCode::kCorruption);
}

TEST(PartialUploads, ADamagedPieceIsNotPassedOn) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  PartialUploadRecord partial = Sample(1, 1'000);
  ASSERT_OK(database->AppendToPartialUpload(SampleBytes(1, 100), &partial));
  PartialUploadRecord wrong = partial;
  wrong.last_piece_bytes = wrong.received_bytes = 200;
  EXPECT_EQ(database->GetSnapshot()->contributing().GetPieces(wrong).status().code(),
            StatusCode::kCorruption);
  EXPECT_EQ(database->AppendToPartialUpload(SampleBytes(2, 10), &wrong).code(),
            StatusCode::kCorruption);
}

// A contribution counts each of its photos once, and keeps what became of it.
TEST(PartialUploads, PhotosAreEnteredInTheirContribution) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ContributionRecord contribution;
  contribution.number = 4;
  contribution.contributor = "anna";
  const auto transaction = database->BeginTransaction();
  transaction->PutContribution(contribution);
  ASSERT_OK(transaction->Commit());
  UploadRecord upload;
  upload.name = "1.jpg";
  upload.contribution = 4;
  ASSERT_EQ(*database->AddUpload(upload, SampleBytes(1, 10)), 1u);
  upload.number = 1;
  ASSERT_EQ(*database->AddUpload(upload, SampleBytes(1, 10)), 1u) << "once more, as by a repair";
  upload.number = 0;
  upload.contribution = 77;
  ASSERT_EQ(*database->AddUpload(upload, SampleBytes(1, 10)), 2u);
  EXPECT_EQ(database->GetSnapshot()->GetUpload(2)->contribution, 0u) << "there is no such one";
  const auto photos = [&] {
    std::vector<ContributedPhoto> all;
    EXPECT_OK(database->GetSnapshot()->contributing().ScanContributedPhotos(
        4, 0, [&](const ContributedPhoto& photo) {
          all.push_back(photo);
          return true;
        }));
    return all;
  };
  ASSERT_EQ(photos().size(), 1u);
  EXPECT_EQ(photos()[0].fate, ContributionFate::kWaiting);
  EXPECT_EQ(database->GetSnapshot()->contributing().FindContribution(4)->value().photo_count, 1u);
  ContributedPhoto fate = photos()[0];
  fate.fate = ContributionFate::kStored;
  fate.image = ImageId(3);
  fate.name.clear();
  ASSERT_OK(database->DeleteUpload(1, &fate));
  EXPECT_EQ(photos()[0].image, ImageId(3));
  fate.upload = 9;
  ASSERT_OK(database->DeleteUpload(2, &fate));
  EXPECT_EQ(photos().size(), 1u) << "it was not entered";
  const auto removal = database->BeginTransaction();
  removal->RemoveContribution(4);
  ASSERT_OK(removal->Commit());
  EXPECT_TRUE(photos().empty());
  EXPECT_FALSE(*database->GetSnapshot()->contributing().FindContribution(4));
  EXPECT_EQ(*database->GetSnapshot()->contributing().LastContribution(), 4u);
}

}  // namespace
}  // namespace veduta
