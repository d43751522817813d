// SPDX-License-Identifier: Apache-2.0
// Goal: the header of a photo tells format, stored size and orientation without any decoding; what
//   is no photo is said to be none; the tags of a TIFF structure are read in both byte orders, and
//   senseless ones are as good as absent; the eight orientations turn pixels and size alike.
// Method: small files of every format; tags written byte by byte; a picture of six different
//   pixels, turned by the definition of each orientation.
#include "engine/camera/photo_header.h"

#include <gtest/gtest.h>

#include "engine/camera/tiff_tags.h"
#include "tests/engine/camera/modern_writer.h"
#include "tests/engine/camera/tiff_writer.h"

namespace veduta {
namespace {

using testing::Append;
using testing::FileBytes;
using testing::TestPicture;

TEST(PhotoHeader, SizeFormatAndOrientationOfEveryFormat) {
  const cv::Mat picture = TestPicture(48, 32);
  const FileBytes jpeg = testing::JpegFile(picture);
  testing::TiffKind turned;
  turned.orientation = 6;
  struct Case {
    FileBytes bytes;
    PhotoFormat format;
    int orientation;
  };
  for (const Case& c :
       {Case{jpeg, PhotoFormat::kJpeg, 1},
        Case{testing::WithExif(jpeg, testing::ExifBlock(8, true)), PhotoFormat::kJpeg, 8},
        Case{testing::WithExif(jpeg, testing::ExifBlock(3, false)), PhotoFormat::kJpeg, 3},
        Case{testing::WithExif(jpeg, testing::ExifBlock(9, false)), PhotoFormat::kJpeg, 1},
        Case{testing::PngFile(picture), PhotoFormat::kPng, 1},
        Case{testing::PngFile(picture, false, 5), PhotoFormat::kPng, 5},
        Case{testing::TiffFile(picture), PhotoFormat::kTiff, 1},
        Case{testing::TiffFile(picture, turned), PhotoFormat::kTiff, 6},
        Case{testing::WebpFile(picture), PhotoFormat::kWebp, 1},
        Case{testing::WebpFile(picture, true, testing::ExifBlock(7, true)), PhotoFormat::kWebp, 7},
        Case{testing::HeifFileOf(picture, {.exif = testing::ExifBlock(6, true)}),
             PhotoFormat::kHeif, 1}}) {
    const PhotoHeader header = ReadPhotoHeader(c.bytes);
    EXPECT_EQ(header.outcome, HeaderOutcome::kRead) << header.detail;
    EXPECT_EQ(header.format, c.format);
    EXPECT_EQ(header.stored_size, (ImageSize{48, 32}));
    EXPECT_EQ(header.orientation, c.orientation);
    // Any beginning of the file is answered too, and never by another size.
    for (size_t size = 0; size < c.bytes.size(); size += 7) {
      const PhotoHeader part = ReadPhotoHeader({c.bytes.data(), size});
      EXPECT_TRUE(part.outcome == HeaderOutcome::kRead ? part.stored_size == header.stored_size
                                                       : !part.detail.empty());
    }
  }
}

TEST(PhotoHeader, ExifIsFoundInEveryFormat) {
  const cv::Mat picture = TestPicture(48, 32);
  const FileBytes exif = testing::ExifBlock(6, true);
  EXPECT_EQ(ReadPhotoHeader(testing::WithExif(testing::JpegFile(picture), exif)).exif, exif);
  EXPECT_EQ(ReadPhotoHeader(testing::WebpFile(picture, false, exif)).exif, exif);
  EXPECT_EQ(ReadPhotoHeader(testing::HeifFileOf(picture, {.exif = exif})).exif, exif);
  EXPECT_EQ(ReadPhotoHeader(testing::PngFile(picture, false, 6)).exif,
            testing::ExifBlock(6, false));
}

// A HEIF comes upright, and its EXIF tells how the camera was held.
TEST(PhotoHeader, HowTheCameraWasHeldIsToldByEveryFormat) {
  const cv::Mat picture = TestPicture(48, 32);
  const FileBytes exif = testing::ExifBlock(3, true);
  EXPECT_EQ(ReadPhotoHeader(testing::HeifFileOf(picture, {.exif = exif})).sensor_orientation, 3);
  EXPECT_EQ(ReadPhotoHeader(testing::HeifFileOf(picture, {})).sensor_orientation, 1);
  const FileBytes jpeg = testing::WithExif(testing::JpegFile(picture), exif);
  EXPECT_EQ(ReadPhotoHeader(jpeg).sensor_orientation, 3);
}

TEST(PhotoHeader, WhatIsNoPhotoIsSaid) {
  const std::string text = "hello, this is a text";
  const FileBytes bytes(text.begin(), text.end());
  EXPECT_EQ(ReadPhotoHeader(bytes).outcome, HeaderOutcome::kUnsupportedFormat);
  EXPECT_EQ(ReadPhotoHeader({}).outcome, HeaderOutcome::kUnsupportedFormat);
  const FileBytes big_tiff = {'I', 'I', '+', 0, 8, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_NE(ReadPhotoHeader(big_tiff).detail.find("BigTIFF"), std::string::npos);
}

// A TIFF whose directories and values lie where they like, in both byte orders: one value is within
// its entry, one behind it, one is too large, one leads nowhere, and the directories lead to each
// other.
TEST(TiffTags, ABlockOfExifHasWhatIsSmallAndSound) {
  for (const bool is_big_endian : {false, true}) {
    FileBytes bytes;
    const auto put = [&](uint32_t number, int size) {
      for (int i = 0; i < size; ++i) {
        const int shift = 8 * (is_big_endian ? size - 1 - i : i);
        bytes.push_back(static_cast<uint8_t>(number >> shift));
      }
    };
    const auto entry = [&](uint32_t tag, uint32_t type, uint32_t count, uint32_t value) {
      put(tag, 2), put(type, 2), put(count, 4), put(value, 4);
    };
    const char order = is_big_endian ? 'M' : 'I';
    bytes = {static_cast<uint8_t>(order), static_cast<uint8_t>(order)};
    put(42, 2), put(8, 4);
    put(5, 2);
    entry(257, 4, 1, 77);
    entry(272, 2, 6, 110);     // "Model"
    entry(273, 4, 1000, 110);  // strips: too large
    entry(305, 2, 20, 0xFFFFFFF0);
    entry(34665, 4, 1, 80);
    put(0, 4);
    bytes.resize(80);
    put(1, 2), entry(34665, 4, 1, 8), put(0, 4);
    bytes.resize(110);
    for (const char c : {'M', 'o', 'd', 'e', 'l', '\0'}) bytes.push_back(static_cast<uint8_t>(c));
    const FileBytes block = ExifOfTiff(bytes);
    EXPECT_LT(block.size(), 200u);
    const auto tags = ReadTiffTags(block);
    ASSERT_TRUE(tags);
    EXPECT_EQ(tags->height_px, 77u);
    const std::string text(block.begin(), block.end());
    EXPECT_NE(text.find("Model"), std::string::npos);
    for (size_t size = 0; size < bytes.size(); ++size)
      EXPECT_LT(ExifOfTiff({bytes.data(), size}).size(), 200u);
  }
  EXPECT_TRUE(ExifOfTiff({}).empty());
}

// Each of eighty entries leads to a directory of eighty values.
TEST(TiffTags, ABlockOfExifStaysSmallHoweverOftenDirectoriesAreNamed) {
  FileBytes bytes = {'I', 'I', 42, 0, 8, 0, 0, 0};
  const auto put = [&](uint32_t number, int size) {
    for (int i = 0; i < size; ++i) bytes.push_back(static_cast<uint8_t>(number >> (8 * i)));
  };
  constexpr uint32_t kEntries = 80, kNext = 8 + 2 + 12 * kEntries + 4;
  put(kEntries, 2);
  for (uint32_t i = 0; i < kEntries; ++i) put(34665, 2), put(4, 2), put(1, 4), put(kNext, 4);
  put(0, 4);
  put(kEntries, 2);
  for (uint32_t i = 0; i < kEntries; ++i) put(1000 + i, 2), put(2, 2), put(256, 4), put(8, 4);
  put(0, 4);
  const FileBytes block = ExifOfTiff(bytes);
  EXPECT_GT(block.size(), 2 * 256 * kEntries);
  EXPECT_LE(block.size(), size_t{1} << 16);
}

TEST(TiffTags, TheFirstOfEqualTagsAndNoneOfAWrongType) {
  FileBytes bytes;
  Append(&bytes, {'I', 'I', 42, 0, 8, 0, 0, 0, 5, 0});
  Append(&bytes, {0, 1, 4, 0, 1, 0, 0, 0, 0x10, 0x27, 0, 0});  // width 10000, a long
  Append(&bytes, {1, 1, 3, 0, 1, 0, 0, 0, 200, 0, 9, 9});      // height 200, a short
  Append(&bytes, {1, 1, 3, 0, 1, 0, 0, 0, 201, 0, 0, 0});      // another height
  Append(&bytes, {18, 1, 2, 0, 1, 0, 0, 0, 6, 0, 0, 0});       // orientation as a text
  Append(&bytes, {18, 1, 3, 0, 2, 0, 0, 0, 6, 0, 0, 0});       // two orientations
  const auto tags = ReadTiffTags(bytes);
  ASSERT_TRUE(tags);
  EXPECT_EQ(tags->width_px, 10000u);
  EXPECT_EQ(tags->height_px, 200u);
  EXPECT_FALSE(tags->orientation);
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(ReadTiffTags({bytes.data(), size})) << "the directory ends after the bytes";
  bytes[2] = 43;
  EXPECT_FALSE(ReadTiffTags(bytes));
}

}  // namespace
}  // namespace veduta
