// SPDX-License-Identifier: Apache-2.0
// Goal: a photo that was taken waits until it is taken out, over closing and opening; its number is
//   its own for ever.
// Method: uploads added, listed, read and deleted, in a database that is closed and opened between.
#include "storage/uploads.h"

#include <gtest/gtest.h>

#include "samples.h"
#include "storage/database.h"

namespace veduta {
namespace {

UploadRecord Upload(uint32_t seed) {
  UploadRecord upload;
  upload.name = std::to_string(seed) + ".jpg";
  upload.contributor = "anna";
  upload.photo = SampleHash(seed);
  upload.size_bytes = 3000;
  return upload;
}

std::vector<uint64_t> NumbersIn(const Database& database) {
  std::vector<uint64_t> numbers;
  const auto uploads = database.GetSnapshot()->ListUploads();
  EXPECT_OK(uploads);
  for (const UploadRecord& upload : *uploads) numbers.push_back(upload.number);
  return numbers;
}

TEST(Uploads, WaitOverClosing) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  for (uint32_t seed = 1; seed <= 300; ++seed) {
    const Result<uint64_t> number = database->AddUpload(Upload(seed), SampleBytes(seed, 3000));
    ASSERT_OK(number);
    EXPECT_EQ(*number, seed);
  }
  ASSERT_OK(database->DeleteUpload(2));
  ASSERT_OK(database->DeleteUpload(300));
  ASSERT_OK(database->DeleteUpload(777)) << "there is none";
  database.reset();
  database = MustOpen(folder / "db", {});
  const std::vector<uint64_t> numbers = NumbersIn(*database);
  ASSERT_EQ(numbers.size(), 298u);
  EXPECT_EQ(numbers[1], 3u);
  EXPECT_EQ(numbers.back(), 299u);
  const auto snapshot = database->GetSnapshot();
  const auto upload = snapshot->GetUpload(256);
  ASSERT_OK(upload);
  EXPECT_EQ(upload->name, "256.jpg");
  EXPECT_EQ(upload->photo, SampleHash(256));
  const auto bytes = snapshot->GetUploadBytes(256);
  ASSERT_OK(bytes);
  EXPECT_TRUE(std::ranges::equal(bytes->bytes(), SampleBytes(256, 3000)));
  EXPECT_EQ(snapshot->GetUpload(300).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot->GetUploadBytes(2).status().code(), StatusCode::kNotFound);
}

TEST(Uploads, NumbersAreNeverUsedAgain) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(database->AddUpload(Upload(1), SampleBytes(1, 10)));
  ASSERT_OK(database->AddUpload(Upload(2), SampleBytes(2, 10)));
  ASSERT_OK(database->DeleteUpload(1));
  ASSERT_OK(database->DeleteUpload(2));
  database.reset();
  database = MustOpen(folder / "db", {});
  EXPECT_TRUE(NumbersIn(*database).empty());
  EXPECT_EQ(*database->AddUpload(Upload(3), SampleBytes(3, 10)), 3u);
}

TEST(Uploads, KeepTheNumberThatTheyHave) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  UploadRecord upload = Upload(1);
  upload.number = 40;
  EXPECT_EQ(*database->AddUpload(upload, SampleBytes(1, 10)), 40u);
  upload.number = 7;
  EXPECT_EQ(*database->AddUpload(upload, SampleBytes(1, 10)), 7u);
  EXPECT_EQ(*database->AddUpload(Upload(2), {}), 41u) << "a photo without bytes waits as well";
  EXPECT_EQ(NumbersIn(*database), (std::vector<uint64_t>{7, 40, 41}));
}

TEST(Uploads, AreNotPutIntoADatabaseThatIsOnlyRead) {
  const TemporaryFolder folder;
  MustCreate(folder / "db").reset();
  DatabaseOptions options;
  options.read_only = true;
  const auto database = Database::Open(folder / "db", options);
  ASSERT_OK(database);
  EXPECT_EQ((*database)->AddUpload(Upload(1), {}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_TRUE(NumbersIn(**database).empty());
}

}  // namespace
}  // namespace veduta
