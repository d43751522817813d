// SPDX-License-Identifier: Apache-2.0
// Goal: a filled photo shows nothing of its private areas and nearly all of the rest, turned as it
//   was; it says of itself what the photo said, and nothing else.
// Method: a picture of noise in each orientation, encoded and decoded; what Examine reads of both.
#include "engine/camera/filled_photo.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "engine/camera/orientation.h"
#include "engine/camera/photo_decoder.h"

namespace veduta {
namespace {

constexpr int kWidth = 96, kHeight = 64;  // upright
const PixelArea kArea{10, 20, 30, 16};

cv::Mat Noise() {
  cv::Mat picture(kHeight, kWidth, CV_8UC3);
  cv::RNG random(5);
  random.fill(picture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(picture, picture, {}, 3);
  return picture;
}

PhotoExamination Examined(int orientation) {
  PhotoExamination examined;
  examined.header.orientation = orientation;
  examined.camera = {"Make", "Model 3", "Lens f/2", 4.25, 1.5};
  examined.gps = GpsFix{-33.856784, 151.215297, -12.5, 4.5, 271.25};
  examined.taken = TakenTime{1'700'000'123, -12'600};
  return examined;
}

TEST(FilledPhoto, ShowsTheRestAlone) {
  const cv::Mat before = Noise();
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const auto photo = FillPhoto(before.clone(), Examined(orientation), {&kArea, 1});
    ASSERT_TRUE(photo.ok()) << photo.status().message();
    const DecodedPhoto decoded =
        DecodePhoto(*photo, {}, {{kWidth, kHeight}, PhotoLayout::kUpright});
    ASSERT_EQ(decoded.outcome, DecodeOutcome::kDecoded) << decoded.detail;
    EXPECT_EQ(decoded.private_areas, std::vector<PixelArea>{kArea});
    const cv::Rect filled(kArea.x, kArea.y, kArea.width, kArea.height);
    // Blocks of 8 px that lie in it are flat.
    const cv::Rect inner(filled.x + 8, filled.y + 4, 8, 8);
    cv::Mat difference;
    cv::absdiff(decoded.bgr(inner), cv::Scalar(128, 128, 128), difference);
    EXPECT_LE(cv::norm(difference, cv::NORM_INF), 8);
    cv::absdiff(decoded.bgr, before, difference);
    difference(filled).setTo(0);
    EXPECT_LT(cv::mean(difference)[1], 3) << orientation;
  }
}

TEST(FilledPhoto, SaysOfItselfWhatThePhotoSaid) {
  const auto photo = FillPhoto(Noise(), Examined(6), {&kArea, 1});
  ASSERT_TRUE(photo.ok()) << photo.status().message();
  const PhotoExamination told = DecoderInProcess().Examine(*photo), said = Examined(6);
  EXPECT_EQ(told.header.orientation, 6);
  EXPECT_EQ(told.header.stored_size, (ImageSize{kHeight, kWidth}));
  EXPECT_EQ(told.camera, said.camera);
  ASSERT_TRUE(told.gps && told.taken);
  EXPECT_NEAR(told.gps->latitude_deg, said.gps->latitude_deg, 1e-9);
  EXPECT_NEAR(told.gps->longitude_deg, said.gps->longitude_deg, 1e-9);
  EXPECT_EQ(told.gps->height_m, said.gps->height_m);
  EXPECT_EQ(told.gps->accuracy_m, said.gps->accuracy_m);
  EXPECT_EQ(told.taken->local_unix_s, said.taken->local_unix_s);
  EXPECT_EQ(told.taken->offset_s, said.taken->offset_s);
}

}  // namespace
}  // namespace veduta
