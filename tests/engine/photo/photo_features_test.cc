// SPDX-License-Identifier: Apache-2.0
// Goal: where extraction starts depends on the photo's size alone; features of a halved photo lie
//   where they are in the photo itself.
// Method: the bounds; a photo of 2^26 px and some more with a few blobs at known places.
#include "engine/photo/photo_features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(PhotoFeatures, TheScaleFollowsFromTheSizeAlone) {
  EXPECT_EQ(FeatureScaleOf(1), FeatureScale::kDoubled);
  EXPECT_EQ(FeatureScaleOf(1u << 25), FeatureScale::kDoubled);
  EXPECT_EQ(FeatureScaleOf((1u << 25) + 1), FeatureScale::kWhole);
  EXPECT_EQ(FeatureScaleOf(1u << 26), FeatureScale::kWhole);
  EXPECT_EQ(FeatureScaleOf((1u << 26) + 1), FeatureScale::kHalved);
  EXPECT_EQ(ExtractionBytes(1000), 36'000u);
  for (const uint64_t pixel_count : {1ull << 25, 1ull << 26, 200'000'000ull})
    EXPECT_LE(ExtractionBytes(pixel_count), 1'300'000'000u) << pixel_count;
}

TEST(PhotoFeatures, OfAPhotoUpTo32MpxAreThoseOfExtractFeatures) {
  cv::Mat gray(300, 400, CV_8UC1, cv::Scalar(90));
  cv::circle(gray, {200, 150}, 9, 220, -1);
  const auto here = ExtractPhotoFeatures(gray, {}, nullptr);
  const auto plain = ExtractFeatures({gray.data, gray.cols, gray.rows, gray.step}, {});
  ASSERT_OK(here);
  EXPECT_EQ(here->keypoints, plain->keypoints);
  EXPECT_EQ(here->descriptors, plain->descriptors);
}

TEST(PhotoFeatures, OfAHalvedPhotoLieWhereTheyAreInThePhoto) {
  cv::Mat gray(8001, 8401, CV_8UC1, cv::Scalar(90));  // 67.2 Mpx, odd both ways
  const cv::Point centers[] = {{1000, 1200}, {7000, 6500}, {4201, 3000}};
  for (const cv::Point& center : centers) cv::circle(gray, center, 20, 220, -1, cv::LINE_AA);
  const auto features = ExtractPhotoFeatures(gray, {}, nullptr);
  ASSERT_OK(features);
  for (const cv::Point& center : centers) {
    double distance_px_min = 1e9;
    for (const Keypoint& k : features->keypoints) {
      const double distance_px = std::hypot(k.x_px - center.x, k.y_px - center.y);
      distance_px_min = std::min(distance_px_min, distance_px);
    }
    EXPECT_LT(distance_px_min, 0.1) << center;
  }
}

}  // namespace
}  // namespace veduta
