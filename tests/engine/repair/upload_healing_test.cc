// SPDX-License-Identifier: Apache-2.0
// Goal: a repair keeps the photos that wait for their turn (HealUploads), and names the damaged.
// Method: waiting photos in a street database, whose values are overwritten; the whole repair is
//   run.
#include "engine/repair/healing.h"
#include "storage/records/upload_record.h"
#include "tests/engine/repair/repaired_city.h"

namespace veduta {
namespace {

class UploadHealing : public testing::Test {
 protected:
  UploadHealing() {
    city_.Add(Walk(6, 0.9, 4));
    for (uint32_t i = 1; i <= 3; ++i) {
      UploadRecord upload;
      upload.name = std::to_string(i) + ".jpg";
      upload.contributor = "anna";
      const std::vector<uint8_t> bytes = SampleBytes(i, 500);
      upload.photo = HashContent(bytes);
      upload.size_bytes = bytes.size();
      EXPECT_OK(city_.parts().database->AddUpload(upload, bytes));
    }
    city_.Close();
  }

  std::vector<uint64_t> Waiting() {
    std::vector<uint64_t> numbers;
    const auto uploads = city_.Ask().door().Uploads();
    EXPECT_OK(uploads);
    for (const UploadAnswer& upload : *uploads) numbers.push_back(upload.number);
    return numbers;
  }

  City city_;
};

TEST_F(UploadHealing, TheWholeOnesAreKeptAndTheOthersNamed) {
  Overwrite(city_, Family::kUploads, UploadBytesKey(1), "another");
  Overwrite(city_, Family::kUploads, UploadKey(3), "no record");
  const RepairAnswer answer = Repair(&city_);
  EXPECT_TRUE(answer.is_repaired);
  EXPECT_EQ(answer.findings.size(), 2u);
  EXPECT_EQ(answer.lost, std::vector<std::string>{"1.jpg"});
  EXPECT_EQ(Waiting(), std::vector<uint64_t>{2});
  EXPECT_EQ(city_.Counts().images, 4u);
}

}  // namespace
}  // namespace veduta
