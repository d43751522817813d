// SPDX-License-Identifier: Apache-2.0
// Goal: pixels, sizes, places and cameras are turned alike by each of EXIF's orientations, and a
//   photo of half a turn is taken the way round that is preferred.
// Method: small pictures without symmetry, and EXIF's definition of its eight values.
#include "engine/camera/orientation.h"

#include <gtest/gtest.h>

#include "engine/camera/photo_decoder.h"
#include "tests/engine/camera/photo_writer.h"

namespace veduta {
namespace {

TEST(Orientation, TurnsPixelsAndSizeAlike) {
  cv::Mat stored(2, 3, CV_8UC1);
  for (int i = 0; i < 6; ++i) stored.at<uint8_t>(i / 3, i % 3) = static_cast<uint8_t>(i);
  // Of each orientation (EXIF 2.32, tag 274): the stored pixel that the upright picture's top left
  // and top right show.
  const int corners[8][2] = {{0, 2}, {2, 0}, {5, 3}, {3, 5}, {0, 3}, {3, 0}, {5, 2}, {2, 5}};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const cv::Mat upright = Upright(stored, orientation);
    const ImageSize size = UprightSize({3, 2}, orientation);
    EXPECT_EQ(size, orientation < 5 ? (ImageSize{3, 2}) : (ImageSize{2, 3})) << orientation;
    ASSERT_EQ(upright.cols, static_cast<int>(size.width_px)) << orientation;
    ASSERT_EQ(upright.rows, static_cast<int>(size.height_px)) << orientation;
    EXPECT_EQ(upright.at<uint8_t>(0, 0), corners[orientation - 1][0]) << orientation;
    EXPECT_EQ(upright.at<uint8_t>(0, upright.cols - 1), corners[orientation - 1][1]) << orientation;
    for (int v = 0; v < upright.rows; ++v) {
      for (int u = 0; u < upright.cols; ++u) {
        const Eigen::Vector2d at = StoredFromUpright({u, v}, {3, 2}, orientation);
        EXPECT_EQ(upright.at<uint8_t>(v, u),
                  stored.at<uint8_t>(static_cast<int>(at.y()), static_cast<int>(at.x())))
            << orientation;
        EXPECT_EQ(UprightFromStored(at, {3, 2}, orientation), Eigen::Vector2d(u, v)) << orientation;
      }
    }
  }
  EXPECT_EQ(StoredFromUpright({2.5, 1.5}, {3, 2}, 0), Eigen::Vector2d(2.5, 1.5)) << "not noted";
}

// A camera that sees the stored pixels, and one that sees them upright, see the same ray.
TEST(Orientation, TurnsCamerasAsPixels) {
  const Eigen::Vector2d middle(1, 0.5);  // of 3x2 px
  for (const int orientation : {0, 1, 3, 6, 8}) {
    const Eigen::Vector2d upright_middle = orientation < 5 ? middle : middle.reverse();
    const Eigen::Vector2d place = upright_middle + Eigen::Vector2d(0.25, -0.5);
    const Eigen::Vector2d stored = StoredFromUpright(place, {3, 2}, orientation) - middle;
    const Eigen::Vector3d ray(stored.x(), stored.y(), 1);
    const Eigen::Vector3d turned = UprightCamFromStoredCam(orientation) * ray;
    EXPECT_LT((turned - Eigen::Vector3d(0.25, -0.5, 1)).norm(), 1e-12) << orientation;
  }
  // What is mirrored is turned alike, and stays so.
  EXPECT_EQ(UprightCamFromStoredCam(4), UprightCamFromStoredCam(3));
  EXPECT_EQ(UprightCamFromStoredCam(5), UprightCamFromStoredCam(6));
  EXPECT_EQ(UprightCamFromStoredCam(7), UprightCamFromStoredCam(8));
}

// Half a turn keeps the size: the sensor's pixels go first, unless the others are preferred.
TEST(DecodePhoto, TakesHalfATurnTheWayThatIsPreferred) {
  const DecodeLimits limits;
  const auto plain = testing::JpegFile(testing::TestPicture(48, 32));
  const cv::Mat stored = DecodePhoto(plain, limits).bgr;
  const auto differ = [](const cv::Mat& a, const cv::Mat& b) {
    return cv::norm(a, b, cv::NORM_INF);
  };
  const auto half = testing::WithExif(plain, testing::ExifBlock(3, true));
  const DecodedPhoto of_sensor = DecodePhoto(half, limits, {48, 32});
  EXPECT_EQ(of_sensor.layout, PhotoLayout::kAsStored);
  EXPECT_EQ(of_sensor.images_orientation(), 3);
  EXPECT_EQ(differ(of_sensor.bgr, stored), 0);
  const DecodedPhoto preferred = DecodePhoto(half, limits, {{48, 32}, PhotoLayout::kUpright});
  EXPECT_EQ(preferred.images_orientation(), 1);
  EXPECT_EQ(differ(preferred.bgr, Upright(stored, 3)), 0);
  EXPECT_EQ(DecodePhoto(half, limits).images_orientation(), 1) << "any size is upright";
  EXPECT_EQ(StoredLayout(3), PhotoLayout::kAsStored);
  EXPECT_EQ(StoredLayout(1), PhotoLayout::kUpright);
  EXPECT_EQ(StoredLayout(0), PhotoLayout::kUpright) << "as a program before decoded it";
  // A mirror's pixels do not.
  for (const int mirrored : {2, 4}) {
    const auto photo = testing::WithExif(plain, testing::ExifBlock(mirrored, true));
    const DecodedPhoto upright = DecodePhoto(photo, limits, {48, 32});
    EXPECT_EQ(upright.images_orientation(), 1);
    EXPECT_EQ(differ(upright.bgr, Upright(stored, mirrored)), 0);
  }
}

}  // namespace
}  // namespace veduta
