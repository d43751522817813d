// SPDX-License-Identifier: Apache-2.0
// Goal: where a pixel of the upright photo is stored is where turning takes it from.
// Method: each pixel of a small picture without symmetry, turned by each of EXIF's values.
#include "engine/camera/orientation.h"

#include <gtest/gtest.h>

#include "tests/engine/camera/photo_writer.h"

namespace veduta {
namespace {

TEST(Orientation, TellsWhereAPixelIsStored) {
  const cv::Mat stored = testing::TestPicture(48, 32);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const cv::Mat upright = Upright(stored, orientation);
    EXPECT_EQ(UprightSize({48, 32}, orientation), (ImageSize{static_cast<uint32_t>(upright.cols),
                                                             static_cast<uint32_t>(upright.rows)}));
    for (int v = 0; v < upright.rows; ++v) {
      for (int u = 0; u < upright.cols; ++u) {
        const cv::Point2d at = StoredPoint({1.0 * u, 1.0 * v}, {48, 32}, orientation);
        ASSERT_EQ(stored.at<cv::Vec3b>(cv::Point(at)), upright.at<cv::Vec3b>(v, u)) << orientation;
      }
    }
  }
}

TEST(Orientation, TurnsThatKeepTheSidesAreKnown) {
  for (int orientation = 1; orientation <= 8; ++orientation)
    EXPECT_EQ(KeepsSides(orientation), orientation >= 2 && orientation <= 4);
}

}  // namespace
}  // namespace veduta
