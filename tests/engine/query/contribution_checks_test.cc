// SPDX-License-Identifier: Apache-2.0
// Goal: `verify` (CheckContributions, CheckUploads) says where something is wrong with a
//   contribution, or with a photo that arrives in parts, and nothing where all is well.
// Method: a database with both, in which keys and values are replaced one at a time.
#include "storage/records/contribution_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/partial_upload_record.h"
#include "storage/records/record_parts.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/stored_families.h"

namespace veduta {
namespace {

constexpr PartialUploadId kId = {1, 2, 3};

class ContributionChecks : public testing::Test {
 protected:
  ContributionChecks() {
    EXPECT_OK(city_.engine().OpenContribution({"anna", "", "", "anna"}));
    UploadRecord upload;
    upload.name = "1.jpg";
    const std::vector<uint8_t> bytes = SampleBytes(1, 500);
    upload.photo = HashContent(bytes);
    upload.size_bytes = bytes.size();
    upload.contribution = 1;
    Database& database = *city_.parts().database;
    EXPECT_OK(database.AddUpload(upload, bytes));
    PartialUploadRecord partial;
    partial.id = kId;
    partial.length_bytes = 2'000'000;
    EXPECT_OK(database.AppendToPartialUpload(SampleBytes(2, 300'000), &partial));
    EXPECT_OK(database.AppendToPartialUpload(SampleBytes(3, 1'000), &partial));
    city_.Close();
    stored_ = std::make_unique<StoredFamilies>(city_.path());
  }

  std::vector<std::string> Violations() {
    const auto violations = FindViolations(*stored_->GetSnapshot(), 1000);
    EXPECT_OK(violations);
    stored_->PutBack();
    return violations.ok() ? *violations : std::vector<std::string>();
  }
  // The one violation that there is; "" where there is none.
  std::string Violation() {
    const std::vector<std::string> all = Violations();
    EXPECT_LE(all.size(), 1u);
    return all.empty() ? "" : all.front();
  }

  City city_;
  std::unique_ptr<StoredFamilies> stored_;
};

TEST_F(ContributionChecks, WhatIsWholeIsNoViolation) {
  EXPECT_EQ(Violation(), "");
}

TEST_F(ContributionChecks, PhotosHaveAContributionThatCountsThem) {
  stored_->Delete(Family::kContributions, ContributionKey(1));
  EXPECT_EQ(Violation(), "contribution 1 has a photo, and nothing else is known of it");
  ContributionRecord record;
  record.number = 1;
  stored_->Put(Family::kContributions, ContributionKey(1), *Encode(record));
  EXPECT_EQ(Violation(), "contribution 1 has more photos than were counted");
}

TEST_F(ContributionChecks, ANumberMustHaveBeenGiven) {
  stored_->Put(Family::kContributions, LastContributionKey(), EncodeU32(0));
  EXPECT_EQ(Violation(), "contribution 1 has a number that was not given yet");
}

TEST_F(ContributionChecks, APhotoThatIsToWaitWaits) {
  stored_->Delete(Family::kContributions, ContributedPhotoKey(1, 1));
  EXPECT_EQ(Violation(), "") << "more were counted";
  ContributedPhoto photo;
  photo.contribution = 1;
  photo.upload = 9;
  stored_->Delete(Family::kContributions, ContributedPhotoKey(1, 1));
  stored_->Put(Family::kContributions, ContributedPhotoKey(1, 9), *Encode(photo));
  EXPECT_EQ(Violation(), "contribution 1 waits for upload 9, which does not wait");
}

TEST_F(ContributionChecks, KeysAndValuesMustBeReadable) {
  stored_->Put(Family::kContributions, "?", "");
  EXPECT_EQ(Violation(), "family contributions, key '?': a key of another kind");
  stored_->Put(Family::kContributions, ContributedPhotoKey(1, 1), "short");
  EXPECT_EQ(Violations().size(), 1u);
  stored_->Put(Family::kContributions, PartialUploadKey(kId), "short");
  EXPECT_EQ(Violations().size(), 2u) << "the record, and pieces of none";
}

TEST_F(ContributionChecks, PiecesAreTheBytesThatWereReceived) {
  const std::string wrong = ": its pieces are not the bytes that it has received";
  const std::string place = "family contributions, key " + KeyText(PartialUploadKey(kId));
  stored_->Put(Family::kUploads, PieceKey(kId, 1), "a few");
  EXPECT_EQ(Violation(), place + wrong);
  stored_->Delete(Family::kUploads, PieceKey(kId, 0));
  EXPECT_EQ(Violation(), place + wrong);
  stored_->Put(Family::kUploads, PieceKey(kId, 3), "one more");
  EXPECT_EQ(Violation(), place + wrong);
  stored_->Delete(Family::kContributions, PartialUploadKey(kId));
  EXPECT_EQ(Violation(),
            "family uploads, key " + KeyText(PieceKey(kId, 0)) + ": a piece of no upload");
}

}  // namespace
}  // namespace veduta
