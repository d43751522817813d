// SPDX-License-Identifier: Apache-2.0
// Goal: what a damaged database still holds can be read, from links, and nothing is written to it.
// Method: a database with every kind of record is opened whole, without its manifest, and as one of
//   another format. tests/engine/repair/ damages single families.
#include "storage/salvage.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "storage/records/image_record.h"
#include "storage/records/record_parts.h"
#include "storage/records/state_record.h"
#include "tests/storage/damage.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

class SalvageTest : public testing::Test {
 protected:
  void SetUp() override {
    DatabaseOptions options;
    options.create = true;
    auto database = Database::Open(path_, options);
    ASSERT_OK(database);
    photo_ = SampleBytes(1, 5000);
    ASSERT_OK((*database)->WritePhotoAhead(HashContent(photo_), photo_, SampleFeatures(3, 4)));
    auto transaction = (*database)->BeginTransaction();
    ImageRecord image = SampleImage(1);
    image.photo = HashContent(photo_);
    image.verdict = Verdict::kPostponed;
    image.reason = Reason::kNoCandidates;
    transaction->PutImage(image);
    name_ = image.name;
    ASSERT_OK(transaction->Commit());
  }

  void ExpectReadable(const Salvage& salvage) {
    const auto photo = salvage.GetPhoto(HashContent(photo_));
    ASSERT_OK(photo);
    EXPECT_EQ(*photo, photo_);
    const auto image = salvage.snapshot().GetImage(ImageId(1));
    ASSERT_OK(image);
    EXPECT_EQ(image->name, name_);
    std::map<std::string, ImageId> names;
    ASSERT_OK(salvage.ScanNames(
        [&](const PhotoName& n, ImageId id) { names[n.contributor + "/" + n.name] = id; }));
    EXPECT_EQ(names, (std::map<std::string, ImageId>{{"anna/" + name_, ImageId(1)}}));
    std::map<ContentHash, ImageId> hashes;
    ASSERT_OK(salvage.ScanHashes([&](const ContentHash& hash, ImageId id) { hashes[hash] = id; }));
    EXPECT_EQ(hashes, (std::map<ContentHash, ImageId>{{HashContent(photo_), ImageId(1)}}));
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "db", scratch_ = folder_ / "scratch";
  std::vector<uint8_t> photo_;
  std::string name_;
};

TEST_F(SalvageTest, ReadsAWholeDatabase) {
  const auto salvage = Salvage::Open(path_, scratch_, {});
  ASSERT_OK(salvage);
  EXPECT_EQ((*salvage)->damage(), std::vector<std::string>());
  EXPECT_FALSE((*salvage)->is_pieced_together());
  ExpectReadable(**salvage);
}

TEST_F(SalvageTest, ReadsLogsWithoutAManifest) {
  for (const auto& entry : std::filesystem::directory_iterator(path_)) {
    if (entry.path().filename().string().starts_with("MANIFEST"))
      std::filesystem::remove(entry.path());
  }
  const auto salvage = Salvage::Open(path_, scratch_, {});
  ASSERT_OK(salvage);
  EXPECT_TRUE((*salvage)->is_pieced_together());
  ExpectReadable(**salvage);
}

TEST_F(SalvageTest, FindsPhotosWhereOnlyBlobFilesAreLeft) {
  { ASSERT_OK((*Database::Open(path_, {}))->Compact()); }
  for (const auto& entry : std::filesystem::directory_iterator(path_)) {
    if (entry.path().extension() != ".blob") std::filesystem::remove(entry.path());
  }
  const auto salvage = Salvage::Open(path_, scratch_, {});
  ASSERT_OK(salvage);
  EXPECT_FALSE((*salvage)->damage().empty());
  const auto photo = (*salvage)->GetPhoto(HashContent(photo_));
  ASSERT_OK(photo);
  EXPECT_EQ(*photo, photo_);
  std::vector<ContentHash> strays;
  (*salvage)->ScanStrayPhotos([&](const ContentHash& hash) {
    strays.push_back(hash);
    return true;
  });
  EXPECT_EQ(strays, std::vector<ContentHash>{HashContent(photo_)});
}

TEST_F(SalvageTest, ReadsFormatTwo) {
  WithRocksdb(
      path_,
      [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
        ASSERT_TRUE(db.Put({}, handle, "format", EncodeU32(2)).ok());
      },
      Family::kMeta);
  WithRocksdb(
      path_,
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
        ASSERT_TRUE(db.Delete({}, handle, NameKey(name_, "anna")).ok());
        ASSERT_TRUE(db.Put({}, handle, name_, EncodeU32(1)).ok());
      },
      Family::kNames);
  const auto salvage = Salvage::Open(path_, scratch_, {});
  ASSERT_OK(salvage);
  EXPECT_EQ((*salvage)->format(), 2u);
  std::map<std::string, ImageId> names;
  ASSERT_OK((*salvage)->ScanNames(
      [&](const PhotoName& n, ImageId id) { names[n.contributor + "/" + n.name] = id; }));
  EXPECT_EQ(names, (std::map<std::string, ImageId>{{"/" + name_, ImageId(1)}}));
}

TEST_F(SalvageTest, RefusesLaterFormats) {
  WithRocksdb(
      path_,
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
        ASSERT_TRUE(db.Put({}, handle, "format", EncodeU32(kFormatVersion + 1)).ok());
      },
      Family::kMeta);
  EXPECT_EQ(Salvage::Open(path_, scratch_, {}).status().code(), StatusCode::kInvalidArgument);
}

TEST_F(SalvageTest, SaysWhereThereIsNoDatabase) {
  EXPECT_EQ(Salvage::Open(folder_ / "none", scratch_, {}).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
