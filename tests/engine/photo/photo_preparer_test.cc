// SPDX-License-Identifier: Apache-2.0
// Goal: a photo is prepared to its features and written ahead; what is wrong with a file is its
//   reason; a known photo is not decoded again; a query's photo touches no database; features on
//   the border of the undistorted photo are dropped.
// Method: small photos made in memory, and files in a temporary folder.
#include "engine/photo/photo_preparer.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "engine/camera/projection.h"
#include "tests/storage/samples.h"
#include "tools/render/street/data_set.h"

namespace veduta {
namespace {

constexpr uint32_t kWidth = 320, kHeight = 240;

CameraModel Model(double k1 = 0) {
  CameraModel model;
  model.width_px = kWidth;
  model.height_px = kHeight;
  model.fx = model.fy = 300;
  model.cx = model.u0 = 159.5;
  model.cy = model.v0 = 119.5;
  model.k1 = k1;
  return model;
}

// Colored blocks of 12 px, by `seed`.
std::vector<uint8_t> BlockPhoto(uint64_t seed) {
  street::StreetPhoto photo{
      kWidth, kHeight, std::vector<uint8_t>(size_t{3} * kWidth * kHeight), {}};
  const std::vector<uint8_t> levels = SampleBytes(seed, 3 * 27 * 20);
  for (uint32_t y = 0; y < kHeight; ++y) {
    for (uint32_t x = 0; x < kWidth; ++x) {
      for (uint32_t c = 0; c < 3; ++c)
        photo.rgb[(y * kWidth + x) * 3 + c] = levels[((y / 12) * 27 + x / 12) * 3 + c];
    }
  }
  return *street::EncodeJpeg(photo, 92);
}

class PhotoPreparerTest : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::Open(folder_ / "db", {.create = true, .sync_wal = false});
    ASSERT_OK(opened);
    database_ = std::move(*opened);
  }
  PreparedPhoto Prepare(const PhotoSource& source, const CameraModel& model = Model()) {
    const PhotoPreparer preparer(database_.get(), &tables_, {});
    auto prepared = preparer.Prepare(source, model, "anna");
    EXPECT_OK(prepared);
    return prepared.ok() ? std::move(*prepared) : PreparedPhoto();
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
  UndistortCache tables_{1 << 20};
};

TEST_F(PhotoPreparerTest, ExtractsAndWritesAhead) {
  const std::vector<uint8_t> bytes = BlockPhoto(1);
  const PreparedPhoto photo = Prepare({"a.jpg", "", bytes});
  EXPECT_EQ(photo.reason, Reason::kNone) << photo.detail;
  EXPECT_EQ(photo.hash, HashContent(bytes));
  EXPECT_EQ(photo.size_bytes, bytes.size());
  EXPECT_EQ(photo.width_px, kWidth);
  EXPECT_GE(photo.features.size(), 60u);
  EXPECT_FALSE(photo.known);
  const auto snapshot = database_->GetSnapshot();
  EXPECT_TRUE(*snapshot->IsWrittenAhead(photo.hash));
  EXPECT_EQ((*snapshot->FindNameAhead(photo.hash))->contributor, "anna");
  EXPECT_EQ(snapshot->GetFeatures(photo.hash)->keypoints, photo.features.keypoints);
  // A file gives the same as its bytes.
  std::ofstream(folder_ / "a.jpg", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  EXPECT_EQ(Prepare({"a.jpg", folder_ / "a.jpg", {}}).features.descriptors,
            photo.features.descriptors);
}

TEST_F(PhotoPreparerTest, AKnownPhotoIsNotDecoded) {
  const std::vector<uint8_t> bytes = BlockPhoto(2);
  PreparedPhoto photo = Prepare({"b.jpg", "", bytes});
  const auto transaction = database_->BeginTransaction();
  ImageRecord image;
  image.id = ImageId(1);
  image.name = "b.jpg";
  image.photo = photo.hash;
  image.camera = CameraId(1);
  image.verdict = Verdict::kPostponed;
  image.reason = Reason::kNoCandidates;
  transaction->PutImage(image);
  ASSERT_OK(transaction->Commit());
  photo = Prepare({"again.jpg", "", bytes});
  EXPECT_TRUE(photo.known);
  EXPECT_EQ(photo.name, "again.jpg");
  EXPECT_EQ(photo.features.size(), 0u);
}

TEST_F(PhotoPreparerTest, AFileThatCannotBeReadIsNoVerdict) {
  const PreparedPhoto absent = Prepare({"absent.jpg", folder_ / "absent.jpg", {}});
  EXPECT_EQ(absent.failure.code(), StatusCode::kNotFound);
  EXPECT_EQ(absent.reason, Reason::kNone);
  const PreparedPhoto of_folder = Prepare({"folder.jpg", folder_ / "", {}});
  EXPECT_EQ(of_folder.failure.code(), StatusCode::kIoError);
}

// Each photo is prepared alone, and the result is the same.
TEST_F(PhotoPreparerTest, ASmallBudgetOfMemoryChangesTheTimeOnly) {
  const std::vector<uint8_t> bytes = BlockPhoto(6);
  PrepareOptions options;
  options.memory_bytes = 1;
  const PhotoPreparer small(database_.get(), &tables_, options);
  const PreparedPhoto plenty = PhotoPreparer(nullptr, &tables_, {}).Extract({"a", "", bytes}, {});
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      const auto photo = small.Prepare({"a", "", bytes}, Model(), "anna");
      ASSERT_OK(photo);
      EXPECT_OK(photo->failure);
      EXPECT_EQ(photo->features.descriptors, plenty.features.descriptors);
      EXPECT_OK(small.Prepare({"a", "", bytes}, Model(), "anna", PhotoPreparer::Company::kAlone));
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(PhotoPreparerTest, WhatIsWrongIsTheReason) {
  EXPECT_EQ(Prepare({"empty.jpg", "", std::vector<uint8_t>()}).reason, Reason::kEmptyFile);
  EXPECT_EQ(Prepare({"text.jpg", "", std::vector<uint8_t>{'a', 'b', 'c', 'd'}}).reason,
            Reason::kUnsupportedFormat);
  CameraModel other = Model();
  other.width_px = 400;
  EXPECT_EQ(Prepare({"size.jpg", "", BlockPhoto(3)}, other).reason, Reason::kWrongSize);
  PrepareOptions options;
  options.limits.size_bytes_max = 10;
  const PhotoPreparer strict(database_.get(), &tables_, options);
  std::ofstream(folder_ / "long.jpg") << "longer than ten bytes";
  const auto large = strict.Prepare({"long.jpg", folder_ / "long.jpg", {}}, Model(), "anna");
  ASSERT_OK(large);
  EXPECT_EQ(large->reason, Reason::kTooLarge);
  options = {};
  options.feature_count_min = 100'000;
  const PhotoPreparer demanding(database_.get(), &tables_, options);
  const auto poor = demanding.Prepare({"c.jpg", "", BlockPhoto(3)}, Model(), "anna");
  ASSERT_OK(poor);
  EXPECT_EQ(poor->reason, Reason::kNoTexture);
  EXPECT_FALSE(*database_->GetSnapshot()->IsWrittenAhead(poor->hash)) << "rejected: not stored";
}

TEST_F(PhotoPreparerTest, AQueryTouchesNoDatabase) {
  const PhotoPreparer preparer(nullptr, &tables_, {});
  const PreparedPhoto photo = preparer.Extract({"q.jpg", "", BlockPhoto(4)}, std::nullopt);
  EXPECT_EQ(photo.reason, Reason::kNone);
  EXPECT_GE(photo.features.size(), 60u);
}

TEST_F(PhotoPreparerTest, NoFeatureLiesOnTheBorderOfAnUndistortedPhoto) {
  const CameraModel distorted = Model(-0.2);
  const PreparedPhoto photo = Prepare({"d.jpg", "", BlockPhoto(5)}, distorted);
  ASSERT_GE(photo.features.size(), 60u);
  EXPECT_EQ(photo.features.descriptors.size(), photo.features.size() * kDescriptorSize);
  for (const Keypoint& k : photo.features.keypoints)
    EXPECT_TRUE(IsInsidePhoto(distorted, {k.x_px, k.y_px}, 4));
}

}  // namespace
}  // namespace veduta
