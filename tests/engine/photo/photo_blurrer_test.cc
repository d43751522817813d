// SPDX-License-Identifier: Apache-2.0
// Goal: the operator's program is asked of every photo that may be stored and of no other; what it
//   names is filled, has no feature, and what came is kept and found by its hash until the image
//   is removed.
// Method: small photos made in memory, shell scripts as programs, a real database.
#include "engine/photo/photo_blurrer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "engine/camera/filled_photo.h"
#include "engine/photo/private_features.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr int kWidth = 320, kHeight = 240;
const char* const kAnswer = R"(echo '{"width": 320, "height": 240, "areas": [[100, 80, 60, 50]]}')";

// Coloured blocks of 12 px.
std::vector<uint8_t> BlockPhoto(uint64_t seed) {
  cv::Mat picture(kHeight, kWidth, CV_8UC3);
  const std::vector<uint8_t> levels = SampleBytes(seed, 3 * 27 * 20);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const uint8_t* const level = &levels[3 * ((y / 12) * 27 + x / 12)];
      picture.at<cv::Vec3b>(y, x) = {level[0], level[1], level[2]};
    }
  }
  return *EncodePicture(picture);
}

class PhotoBlurrerTest : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::Open(folder_ / "db", {.create = true, .sync_wal = false});
    ASSERT_OK(opened);
    database_ = std::move(*opened);
    preparer_ = std::make_unique<PhotoPreparer>(database_.get(), &tables_, PrepareOptions());
  }
  // One that notes that it was asked.
  std::string Program(const std::string& text) {
    const std::string path = folder_ / "program";
    std::ofstream(path) << "#!/bin/sh\necho asked >> " << folder_ / "asked"
                        << "\n"
                        << text << "\n";
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path;
  }
  Result<BlurredPhoto> Blur(const std::string& text, const std::vector<uint8_t>& bytes) {
    return PhotoBlurrer(Program(text), preparer_.get(), database_.get()).Blur({"a", "", bytes});
  }
  bool WasAsked() const { return std::filesystem::exists(folder_ / "asked"); }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
  UndistortCache tables_{1 << 20};
  std::unique_ptr<PhotoPreparer> preparer_;
};

TEST_F(PhotoBlurrerTest, WhatIsPrivateHasNoFeature) {
  const std::vector<uint8_t> bytes = BlockPhoto(1);
  const auto blurred = Blur(kAnswer, bytes);
  ASSERT_OK(blurred);
  ASSERT_TRUE(blurred->was_asked && blurred->filled);
  EXPECT_EQ(blurred->original, bytes);
  const PixelArea area{100, 80, 60, 50};
  EXPECT_EQ(ReadPrivateAreas(*blurred->filled), std::vector<PixelArea>{area});
  const Features all = preparer_->Extract({"a", "", bytes}, std::nullopt).features,
                 rest = preparer_->Extract({"a", "", *blurred->filled}, std::nullopt).features;
  EXPECT_LT(rest.size(), all.size());
  EXPECT_GT(rest.size(), 60u);
  Features dropped = rest;
  DropPrivate({&area, 1}, nullptr, &dropped);
  EXPECT_EQ(dropped.keypoints, rest.keypoints) << "nothing is left to drop";
}

TEST_F(PhotoBlurrerTest, TheSameAnswerGivesTheSameBytes) {
  const auto once = Blur(kAnswer, BlockPhoto(1)), again = Blur(kAnswer, BlockPhoto(1));
  ASSERT_OK(once);
  ASSERT_OK(again);
  EXPECT_EQ(once->filled, again->filled);
  // What was filled before stays private.
  const auto more =
      Blur(R"(echo '{"width": 320, "height": 240, "areas": [[0, 0, 9, 9]]}')", *once->filled);
  ASSERT_OK(more);
  EXPECT_EQ(ReadPrivateAreas(*more->filled),
            (std::vector<PixelArea>{{0, 0, 9, 9}, {100, 80, 60, 50}}));
}

TEST_F(PhotoBlurrerTest, AsksOfNothingThatIsStoredOrNoPhoto) {
  const std::vector<uint8_t> original = BlockPhoto(2), filled = BlockPhoto(3);
  ImageRecord image;
  image.id = ImageId(1);
  image.name = "a";
  image.photo = HashContent(filled);
  image.camera = CameraId(1);
  image.verdict = Verdict::kPostponed;
  image.reason = Reason::kNoCandidates;
  ASSERT_OK(database_->WritePhotoAhead(image.photo, filled, {}));
  auto transaction = database_->BeginTransaction();
  transaction->PutImage(image);
  transaction->SealOriginal(image.id, original);
  ASSERT_OK(transaction->Commit());
  EXPECT_EQ(*database_->GetSnapshot()->FindImageByPhoto(HashContent(original)), image.id);
  for (const std::vector<uint8_t>& bytes : {original, filled, std::vector<uint8_t>{1, 2, 3}}) {
    const auto blurred = Blur(kAnswer, bytes);
    ASSERT_OK(blurred);
    EXPECT_FALSE(blurred->was_asked || blurred->filled);
  }
  EXPECT_FALSE(WasAsked());
  // Nothing of it is known once the image is gone.
  transaction = database_->BeginTransaction();
  transaction->RemoveImage(image.id);
  ASSERT_OK(transaction->Commit());
  const auto snapshot = database_->GetSnapshot();
  EXPECT_EQ(*snapshot->FindImageByPhoto(HashContent(original)), std::nullopt);
  EXPECT_EQ(snapshot->GetOriginal(image.id).status().code(), StatusCode::kNotFound);
}

TEST_F(PhotoBlurrerTest, WithoutAnAnswerThereIsNoPhoto) {
  EXPECT_EQ(Blur("exit 1", BlockPhoto(4)).status().code(), StatusCode::kBusy);
  EXPECT_TRUE(WasAsked());
  PhotoBlurrer stopped(Program(kAnswer), preparer_.get(), database_.get());
  stopped.Stop();
  EXPECT_EQ(stopped.Blur({"a", "", BlockPhoto(4)}).status().code(), StatusCode::kBusy);
  const auto clean = Blur(R"(echo '{"width": 320, "height": 240, "areas": []}')", BlockPhoto(4));
  ASSERT_OK(clean);
  EXPECT_TRUE(clean->was_asked);
  EXPECT_FALSE(clean->filled);
}

}  // namespace
}  // namespace veduta
