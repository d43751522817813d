// SPDX-License-Identifier: Apache-2.0
// Goal: a repair keeps the photos that wait for their turn (HealUploads), and names the damaged.
// Method: waiting photos in a street database, whose values are overwritten; the whole repair is
//   run.
#include "engine/repair/healing.h"
#include "storage/records/upload_record.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/damage.h"

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

  void Overwrite(Family family, const std::string& key, const std::string& value) {
    WithRocksdb(
        city_.path(),
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.Put({}, handle, key, value).ok());
        },
        family);
  }

  RepairAnswer Repair() {
    RepairRequest request;
    request.apply = true;
    request.thread_count = 2;
    const auto answer = Engine::Repair(city_.path(), request);
    EXPECT_OK(answer);
    city_.Open();
    EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
    return answer.ok() ? *answer : RepairAnswer();
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
  Overwrite(Family::kUploads, UploadBytesKey(1), "another");
  Overwrite(Family::kUploads, UploadKey(3), "no record");
  const RepairAnswer answer = Repair();
  EXPECT_TRUE(answer.is_repaired);
  EXPECT_EQ(answer.findings.size(), 2u);
  EXPECT_EQ(answer.lost, std::vector<std::string>{"1.jpg"});
  EXPECT_EQ(Waiting(), std::vector<uint64_t>{2});
  EXPECT_EQ(city_.Counts().images, 4u);
}

}  // namespace
}  // namespace veduta
