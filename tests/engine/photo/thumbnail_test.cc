// SPDX-License-Identifier: Apache-2.0
// Goal: a small picture is as large as was asked and looks like the photo; one that is small
//   already stays so.
// Method: pictures of two colours in many shapes, decoded again.
#include "engine/photo/thumbnail.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "engine/camera/photo_decoder.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

cv::Mat Halves(int width, int height) {
  cv::Mat picture(height, width, CV_8UC3, cv::Scalar(200, 40, 30));
  picture.colRange(width / 2, width).setTo(cv::Scalar(20, 60, 220));
  return picture;
}

DecodedPhoto Small(int width, int height, uint32_t side_px) {
  const auto jpeg = MakeThumbnail(Halves(width, height), side_px);
  EXPECT_OK(jpeg);
  return DecodePhoto(*jpeg, {});
}

TEST(Thumbnail, HasTheSideThatIsAsked) {
  const struct {
    int width, height;
    uint32_t side, small_width, small_height;
  } cases[] = {{640, 480, 64, 64, 48}, {480, 640, 64, 48, 64}, {1000, 3, 100, 100, 1},
               {40, 30, 64, 40, 30},   {64, 64, 64, 64, 64},   {640, 480, 1, 1, 1}};
  for (const auto& c : cases) {
    const DecodedPhoto small = Small(c.width, c.height, c.side);
    ASSERT_EQ(small.outcome, DecodeOutcome::kDecoded) << small.detail;
    EXPECT_EQ(small.upright_size, (ImageSize{c.small_width, c.small_height}));
  }
}

TEST(Thumbnail, LooksLikeThePhoto) {
  const DecodedPhoto small = Small(640, 480, 64);
  const auto left = small.bgr.at<cv::Vec3b>(20, 10), right = small.bgr.at<cv::Vec3b>(20, 50);
  EXPECT_NEAR(left[0], 200, 6);
  EXPECT_NEAR(left[2], 30, 6);
  EXPECT_NEAR(right[0], 20, 6);
  EXPECT_NEAR(right[2], 220, 6);
}

}  // namespace
}  // namespace veduta
