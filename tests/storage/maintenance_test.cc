// SPDX-License-Identifier: Apache-2.0
// Goal: a backup is a copy that can be read to its last byte, or there is none and the failure says
//   what is damaged.
// Method: a byte of a stored photo, and one of a table, is flipped before a checkpoint is made.
#include "storage/maintenance.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

class CheckpointTest : public testing::Test {
 protected:
  void SetUp() override {
    DatabaseOptions options;
    options.create = true;
    auto database = Database::Open(path_, options);
    ASSERT_OK(database);
    ASSERT_OK((*database)->WritePhotoAhead(HashContent(photo_), photo_, SampleFeatures(3, 4)));
    auto transaction = (*database)->BeginTransaction();
    ImageRecord image = SampleImage(1);
    image.photo = HashContent(photo_);
    image.verdict = Verdict::kPostponed;
    image.reason = Reason::kNoCandidates;
    transaction->PutImage(image);
    ASSERT_OK(transaction->Commit());
    ASSERT_OK((*database)->Compact());
  }

  // Flips the byte after the first occurrence of `wanted` in a file with this extension.
  void FlipAfter(const std::string& wanted, const std::string& extension) {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      if (entry.path().extension() != extension) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
      const size_t at = bytes.find(wanted);
      if (at == std::string::npos) continue;
      bytes[at + wanted.size()] ^= 1;
      std::ofstream(entry.path(), std::ios::binary) << bytes;
      return;
    }
    ADD_FAILURE() << "no file has these bytes";
  }

  Status Copy() {
    auto database = Database::Open(path_, {});
    EXPECT_OK(database);
    const Status copied = (*database)->CreateCheckpoint(folder_ / "copy");
    EXPECT_EQ(copied.ok(), std::filesystem::exists(folder_ / "copy"));
    return copied;
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "db";
  const std::vector<uint8_t> photo_ = SampleBytes(1, 5000);
};

TEST_F(CheckpointTest, OfAWholeDatabaseIsThere) {
  EXPECT_OK(Copy());
}

TEST_F(CheckpointTest, NamesADamagedPhoto) {
  FlipAfter(std::string(photo_.begin(), photo_.begin() + 100), ".blob");
  const Status copied = Copy();
  EXPECT_EQ(copied.code(), StatusCode::kCorruption);
  EXPECT_NE(copied.message().find("family photos, key"), std::string::npos) << copied.message();
}

TEST_F(CheckpointTest, NamesADamagedTable) {
  FlipAfter(SampleImage(1).name.substr(0, 6), ".sst");
  const Status copied = Copy();
  EXPECT_EQ(copied.code(), StatusCode::kCorruption);
  EXPECT_NE(copied.message().find("family "), std::string::npos) << copied.message();
}

}  // namespace
}  // namespace veduta
