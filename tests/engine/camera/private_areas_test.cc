// SPDX-License-Identifier: Apache-2.0
// Goal: a photo tells the areas that were written into it, and whatever is no list of areas is
//   none; areas lie in the stored photo where they lie in the upright one.
// Method: segments cut, changed and lengthened at every byte; one pixel followed through each
//   orientation by Upright itself.
#include "engine/camera/private_areas.h"

#include <gtest/gtest.h>

#include "engine/camera/orientation.h"

namespace veduta {
namespace {

const std::vector<PixelArea> kAreas = {{3, 4, 5, 6}, {65535, 0, 1, 65535}};

std::vector<uint8_t> PhotoWith(const std::vector<PixelArea>& areas) {
  std::vector<uint8_t> photo = {0xFF, 0xD8};
  const std::vector<uint8_t> segment = PrivateAreasSegment(areas);
  photo.insert(photo.end(), segment.begin(), segment.end());
  photo.insert(photo.end(), {0xFF, 0xD9});
  return photo;
}

TEST(PrivateAreas, ComeBack) {
  EXPECT_EQ(ReadPrivateAreas(PhotoWith(kAreas)), kAreas);
  const std::vector<PixelArea> most(kPrivateAreasMax, {1, 2, 3, 4});
  EXPECT_EQ(ReadPrivateAreas(PhotoWith(most)), most);
}

TEST(PrivateAreas, WhatIsNoListIsNone) {
  const std::vector<uint8_t> photo = PhotoWith(kAreas);
  const size_t end = photo.size() - 2, before_areas = end - 8 * kAreas.size();
  for (size_t size = 0; size < end; ++size)
    EXPECT_TRUE(ReadPrivateAreas(std::span(photo).first(size)).empty()) << size;
  for (size_t i = 0; i < before_areas; ++i) {
    std::vector<uint8_t> changed = photo;
    changed[i] ^= 0x10;
    EXPECT_TRUE(ReadPrivateAreas(changed).empty()) << i;
  }
  std::vector<uint8_t> empty = photo;
  for (size_t i = 4; i < 6; ++i) empty[before_areas + i] = 0;  // a width of 0
  EXPECT_TRUE(ReadPrivateAreas(empty).empty());
}

TEST(PrivateAreas, AreClippedToThePhoto) {
  EXPECT_EQ(ClipArea({8, 2, 9, 3}, {10, 20}), (PixelArea{8, 2, 2, 3}));
  EXPECT_EQ(ClipArea({65535, 0, 65535, 1}, {10, 20}), std::nullopt);
  EXPECT_EQ(ClipArea({0, 20, 1, 1}, {10, 20}), std::nullopt);
}

TEST(PrivateAreas, LieWhereThePhotoWasTurned) {
  const ImageSize stored{7, 4};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const ImageSize upright = UprightSize(stored, orientation);
    for (uint16_t y = 0; y + 2u <= upright.height_px; ++y) {
      for (uint16_t x = 0; x + 3u <= upright.width_px; ++x) {
        const PixelArea area = AreaAsStored({x, y, 3, 2}, stored, orientation);
        cv::Mat picture = cv::Mat::zeros(4, 7, CV_8UC1);
        picture(cv::Rect(area.x, area.y, area.width, area.height)).setTo(1);
        const cv::Mat turned = Upright(picture, orientation);
        EXPECT_EQ(cv::sum(turned)[0], 6) << orientation;
        EXPECT_EQ(cv::sum(turned(cv::Rect(x, y, 3, 2)))[0], 6) << orientation;
      }
    }
  }
}

}  // namespace
}  // namespace veduta
