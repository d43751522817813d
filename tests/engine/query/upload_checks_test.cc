// SPDX-License-Identifier: Apache-2.0
// Goal: `verify` (CheckUploads) says where something is wrong with a photo that waits, and nothing
//   where all is well.
// Method: a database with waiting photos, in which keys and values are replaced one at a time.
#include "storage/records/upload_record.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/stored_families.h"

namespace veduta {
namespace {

class UploadChecks : public testing::Test {
 protected:
  UploadChecks() {
    for (uint32_t i = 1; i <= 2; ++i) {
      UploadRecord upload;
      upload.name = std::to_string(i) + ".jpg";
      const std::vector<uint8_t> bytes = SampleBytes(i, 500);
      upload.photo = HashContent(bytes);
      upload.size_bytes = bytes.size();
      EXPECT_OK(city_.parts().database->AddUpload(upload, bytes));
    }
    city_.Close();
    stored_ = std::make_unique<StoredFamilies>(city_.path());
  }

  // The one violation that there is; "" where there is none.
  std::string Violation() {
    const auto violations = FindViolations(*stored_->GetSnapshot(), 1000);
    EXPECT_OK(violations);
    EXPECT_LE(violations->size(), 1u);
    stored_->PutBack();
    return violations->empty() ? "" : violations->front();
  }

  City city_;
  std::unique_ptr<StoredFamilies> stored_;
};

TEST_F(UploadChecks, WhatIsWholeIsNoViolation) {
  EXPECT_EQ(Violation(), "");
}

TEST_F(UploadChecks, APhotoMustBeTheOneThatCame) {
  stored_->Put(Family::kUploads, UploadBytesKey(2), "another");
  EXPECT_EQ(Violation(), "upload 2 has not its photo");
  stored_->Delete(Family::kUploads, UploadBytesKey(1));
  EXPECT_EQ(Violation(), "upload 1 has not its photo");
}

TEST_F(UploadChecks, APhotoNeedsARecord) {
  stored_->Delete(Family::kUploads, UploadKey(1));
  EXPECT_EQ(Violation(), "upload 1 has a photo, and nothing else is known of it");
}

TEST_F(UploadChecks, ANumberMustHaveBeenGiven) {
  stored_->Put(Family::kUploads, LastUploadKey(), EncodeLastUpload(1));
  EXPECT_EQ(Violation(), "upload 2 has a number that was not given yet");
}

TEST_F(UploadChecks, KeysAndValuesMustBeReadable) {
  stored_->Put(Family::kUploads, "?", "");
  EXPECT_EQ(Violation(), "family uploads, key '?': a key of an unknown kind");
  stored_->Put(Family::kUploads, LastUploadKey(), "short");
  const auto violations = FindViolations(*stored_->GetSnapshot(), 1000);
  ASSERT_OK(violations);
  EXPECT_EQ(violations->size(), 3u) << "the entry, and both numbers";
}

}  // namespace
}  // namespace veduta
