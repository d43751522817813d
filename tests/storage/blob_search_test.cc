// SPDX-License-Identifier: Apache-2.0
// Goal: photos are found in blob files without any table that leads to them, also behind a damaged
//   header, and never with other bytes than their own.
// Method: photos are written to a database and flushed; its blob files are read, whole and damaged.
#include "storage/blob_search.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

class BlobSearchTest : public testing::Test {
 protected:
  void SetUp() override {
    DatabaseOptions options;
    options.create = true;
    auto database = Database::Open(folder_ / "db", options);
    ASSERT_OK(database);
    for (uint64_t seed = 1; seed <= 5; ++seed) {
      photos_.push_back(SampleBytes(seed, 2000 + seed));
      ASSERT_OK((*database)->WritePhotoAhead(HashContent(photos_.back()), photos_.back(),
                                             SampleFeatures(3, 4)));
    }
    ASSERT_OK((*database)->Compact());
  }

  // Flips a byte so many bytes before the photo's own bytes.
  void FlipBefore(size_t photo, size_t distance) {
    const std::string wanted(photos_[photo].begin(), photos_[photo].end());
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "db")) {
      if (entry.path().extension() != ".blob") continue;
      std::ifstream in(entry.path(), std::ios::binary);
      std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
      const size_t at = bytes.find(wanted);
      if (at == std::string::npos) continue;
      bytes[at - distance] ^= 1;
      std::ofstream(entry.path(), std::ios::binary) << bytes;
      return;
    }
    ADD_FAILURE() << "the photo is in no blob file";
  }

  size_t CountFound() const {
    const BlobSearch search(folder_ / "db");
    size_t found = 0;
    for (const std::vector<uint8_t>& photo : photos_) {
      const auto bytes = search.Find(HashContent(photo), photo.size());
      if (!bytes) continue;
      EXPECT_EQ(*bytes, photo);
      ++found;
    }
    size_t scanned = 0;
    search.Scan([&](const ContentHash&) { return ++scanned > 0; });
    EXPECT_LE(scanned, found);
    return found;
  }

  TemporaryFolder folder_;
  std::vector<std::vector<uint8_t>> photos_;
};

TEST_F(BlobSearchTest, FindsEveryPhoto) {
  EXPECT_EQ(CountFound(), photos_.size());
  EXPECT_FALSE(BlobSearch(folder_ / "db").Find(ContentHash(), 0));
}

// Wherever a bit flips beside the photos' own bytes, all photos are found.
TEST_F(BlobSearchTest, FindsPhotosBesideDamage) {
  for (size_t distance = 1; distance <= 64; ++distance) {
    FlipBefore(1, distance);
    EXPECT_EQ(CountFound(), photos_.size()) << distance;
    FlipBefore(1, distance);
  }
}

TEST_F(BlobSearchTest, FindsNoPhotoWithOtherBytes) {
  FlipBefore(2, 0);
  EXPECT_EQ(CountFound(), photos_.size() - 1);
}

TEST_F(BlobSearchTest, FindsNothingWhereThereIsNoFolder) {
  EXPECT_FALSE(BlobSearch(folder_ / "none").Find(HashContent(photos_[0]), 0));
}

}  // namespace
}  // namespace veduta
