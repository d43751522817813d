// SPDX-License-Identifier: Apache-2.0
// Goal: every kind of photo is decoded to the right pixels the right way round, or refused for
//   the right reason.
// Method: a picture without symmetry, written by the test in each format; orientations are
//   checked against the definition of EXIF's eight values, pixel by pixel; sizes are wanted and
//   not met.
#include "engine/camera/photo_decoder.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "engine/camera/gray_image.h"
#include "engine/camera/orientation.h"
#include "tests/engine/camera/heif_grid_writer.h"
#include "tests/engine/camera/modern_writer.h"
#include "tests/engine/camera/photo_writer.h"
#include "tests/engine/camera/tiff_writer.h"

namespace veduta {
namespace {

using testing::FileBytes;
using testing::JpegFile;
using testing::PngFile;
using testing::PngKind;
using testing::RgbRows;
using testing::TestPicture;
using testing::TiffFile;
using testing::TiffKind;
using testing::WithExif;
using testing::WithSegment;

const DecodeLimits kLimits;

double LargestDifference(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return 1e9;
  return cv::norm(a, b, cv::NORM_INF);
}

// Where EXIF's `orientation` puts the upright pixel (u, v) in the stored image (EXIF 2.32: which
// visual edges the first row and the first column are).
cv::Vec3b StoredPixel(const cv::Mat& stored, int orientation, int u, int v) {
  const int right = stored.cols - 1, bottom = stored.rows - 1;
  switch (orientation) {
    case 2:
      return stored.at<cv::Vec3b>(v, right - u);  // row 0 top, column 0 right
    case 3:
      return stored.at<cv::Vec3b>(bottom - v, right - u);  // bottom, right
    case 4:
      return stored.at<cv::Vec3b>(bottom - v, u);  // bottom, left
    case 5:
      return stored.at<cv::Vec3b>(u, v);  // left, top
    case 6:
      return stored.at<cv::Vec3b>(bottom - u, v);  // right, top
    case 7:
      return stored.at<cv::Vec3b>(bottom - u, right - v);  // right, bottom
    case 8:
      return stored.at<cv::Vec3b>(u, right - v);  // left, bottom
    default:
      return stored.at<cv::Vec3b>(v, u);
  }
}

void ExpectUpright(const DecodedPhoto& photo, const cv::Mat& stored, int orientation) {
  ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
  EXPECT_EQ(photo.orientation, orientation);
  EXPECT_EQ(photo.layout, PhotoLayout::kUpright);
  const bool swaps = orientation >= 5;
  ASSERT_EQ(photo.bgr.cols, swaps ? stored.rows : stored.cols);
  ASSERT_EQ(photo.bgr.rows, swaps ? stored.cols : stored.rows);
  int wrong = 0;
  for (int v = 0; v < photo.bgr.rows; ++v) {
    for (int u = 0; u < photo.bgr.cols; ++u) {
      if (photo.bgr.at<cv::Vec3b>(v, u) != StoredPixel(stored, orientation, u, v)) ++wrong;
    }
  }
  EXPECT_EQ(wrong, 0) << "orientation " << orientation;
  EXPECT_EQ(LargestDifference(photo.gray, GrayFromBgr(photo.bgr)), 0);
}

TEST(GrayFromBgr, IsTheFixedFormulaAndKeepsGray) {
  cv::Mat bgr(1, 259, CV_8UC3);
  for (int i = 0; i < 256; ++i) bgr.at<cv::Vec3b>(0, i) = cv::Vec3b::all(static_cast<uint8_t>(i));
  bgr.at<cv::Vec3b>(0, 256) = {255, 0, 0};
  bgr.at<cv::Vec3b>(0, 257) = {0, 255, 0};
  bgr.at<cv::Vec3b>(0, 258) = {0, 0, 255};
  const cv::Mat gray = GrayFromBgr(bgr);
  for (int i = 0; i < 256; ++i) EXPECT_EQ(gray.at<uint8_t>(0, i), i);
  EXPECT_EQ(gray.at<uint8_t>(0, 256), 29);
  EXPECT_EQ(gray.at<uint8_t>(0, 257), 150);
  EXPECT_EQ(gray.at<uint8_t>(0, 258), 76);
}

TEST(DecodePhoto, ReadsJpegs) {
  const cv::Mat picture = TestPicture(161, 97);
  for (const int flags : {0, TJFLAG_PROGRESSIVE}) {
    for (const int subsampling : {TJSAMP_444, TJSAMP_422, TJSAMP_420, TJSAMP_440, TJSAMP_411}) {
      const DecodedPhoto photo = DecodePhoto(JpegFile(picture, flags, subsampling), kLimits);
      ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
      EXPECT_EQ(photo.format, PhotoFormat::kJpeg);
      EXPECT_EQ(photo.detail, "");
      EXPECT_EQ(photo.stored_size, (ImageSize{161, 97}));
      EXPECT_LT(cv::norm(photo.bgr, picture, cv::NORM_L1) / (3 * picture.total()), 4.0);
      EXPECT_EQ(LargestDifference(photo.gray, GrayFromBgr(photo.bgr)), 0);
    }
  }
  const DecodedPhoto gray = DecodePhoto(JpegFile(picture, 0, TJSAMP_GRAY), kLimits);
  ASSERT_EQ(gray.outcome, DecodeOutcome::kDecoded) << gray.detail;
  EXPECT_LT(LargestDifference(gray.gray, GrayFromBgr(picture)), 30);
  EXPECT_EQ(gray.bgr.at<cv::Vec3b>(50, 50), cv::Vec3b::all(gray.gray.at<uint8_t>(50, 50)));
}

TEST(DecodePhoto, ReadsPngsExactly) {
  const cv::Mat picture = TestPicture(61, 37);
  for (const bool is_interlaced : {false, true}) {
    const DecodedPhoto photo = DecodePhoto(PngFile(picture, is_interlaced), kLimits);
    ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
    EXPECT_EQ(photo.format, PhotoFormat::kPng);
    EXPECT_EQ(LargestDifference(photo.bgr, picture), 0);
  }
}

TEST(DecodePhoto, ReadsWebps) {
  const cv::Mat picture = TestPicture(61, 37);
  for (const bool is_lossless : {false, true}) {
    const DecodedPhoto photo = DecodePhoto(testing::WebpFile(picture, is_lossless), kLimits);
    ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
    EXPECT_EQ(photo.format, PhotoFormat::kWebp);
    EXPECT_EQ(photo.stored_size, (ImageSize{61, 37}));
    EXPECT_LT(cv::norm(photo.bgr, picture, cv::NORM_L1) / (3 * picture.total()),
              is_lossless ? 1e-9 : 4.0);
  }
}

TEST(DecodePhoto, ReadsHeifs) {
  const cv::Mat picture = TestPicture(98, 66);
  const FileBytes bytes = testing::HeifFileOf(picture);
  ASSERT_FALSE(bytes.empty()) << "Debian's libheif writes HEIC";
  const DecodedPhoto photo = DecodePhoto(bytes, kLimits);
  ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
  EXPECT_EQ(photo.format, PhotoFormat::kHeif);
  EXPECT_EQ(photo.stored_size, (ImageSize{98, 66}));
  EXPECT_LT(cv::norm(photo.bgr, picture, cv::NORM_L1) / (3 * picture.total()), 4.0);
  EXPECT_EQ(LargestDifference(photo.gray, GrayFromBgr(photo.bgr)), 0);
}

TEST(DecodePhoto, ConvertsOtherKindsOfPng) {
  const auto pixel = [](const PngKind& kind, const std::vector<uint8_t>& row) {
    // The same row twice, so that a wrong stride shows.
    std::vector<uint8_t> rows = row;
    rows.insert(rows.end(), row.begin(), row.end());
    const DecodedPhoto photo = DecodePhoto(PngFile(2, 2, kind, rows), kLimits);
    EXPECT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
    return photo.bgr.empty() ? cv::Vec3b(1, 1, 1) : photo.bgr.at<cv::Vec3b>(1, 1);
  };
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_GRAY, 8}, {7, 200}), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_GRAY, 1}, {0x40}), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_GRAY, 4}, {0x3A}), cv::Vec3b(170, 170, 170));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_GRAY, 16}, {0, 0, 0x80, 0xFF}), cv::Vec3b(128, 128, 128));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_GRAY_ALPHA, 8}, {1, 2, 90, 0}), cv::Vec3b(90, 90, 90));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_RGB, 16}, {0, 0, 0, 0, 0, 0, 10, 0, 20, 0, 30, 0}),
            cv::Vec3b(30, 20, 10));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_RGB_ALPHA, 8}, {0, 0, 0, 0, 10, 20, 30, 5}),
            cv::Vec3b(30, 20, 10))
      << "alpha dropped";
  EXPECT_EQ(
      pixel({PNG_COLOR_TYPE_RGB_ALPHA, 16}, {0, 0, 0, 0, 0, 0, 0, 0, 10, 0, 20, 0, 30, 0, 0, 0}),
      cv::Vec3b(30, 20, 10));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_PALETTE, 8}, {0, 100}), cv::Vec3b(50, 155, 100));
  EXPECT_EQ(pixel({PNG_COLOR_TYPE_PALETTE, 4}, {0x0C}), cv::Vec3b(6, 243, 12));
}

TEST(DecodePhoto, ReadsTiffsExactly) {
  const cv::Mat picture = TestPicture(61, 137);
  for (const int compression :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
    for (const bool is_big_endian : {false, true}) {
      for (const int layout : {0, 1, 2, 3}) {
        TiffKind kind;
        kind.compression = compression;
        kind.is_big_endian = is_big_endian;
        kind.is_tiled = layout == 1;
        kind.is_planar = layout == 2;
        kind.rows_per_strip = layout == 3 ? 137 : 7;
        const DecodedPhoto photo = DecodePhoto(TiffFile(picture, kind), kLimits);
        ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded)
            << photo.detail << " compression " << compression;
        EXPECT_EQ(photo.format, PhotoFormat::kTiff);
        EXPECT_EQ(LargestDifference(photo.bgr, picture), 0)
            << "compression " << compression << " layout " << layout;
      }
    }
  }
}

TEST(DecodePhoto, ConvertsOtherKindsOfTiff) {
  const auto pixel = [](int samples, int bits, int photometric, std::vector<uint8_t> row) {
    std::vector<uint8_t> rows = row;
    rows.insert(rows.end(), row.begin(), row.end());
    const DecodedPhoto photo =
        DecodePhoto(TiffFile(2, 2, {samples, bits, photometric}, rows), kLimits);
    EXPECT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
    return photo.bgr.empty() ? cv::Vec3b(1, 1, 1) : photo.bgr.at<cv::Vec3b>(1, 1);
  };
  EXPECT_EQ(pixel(1, 8, PHOTOMETRIC_MINISBLACK, {7, 200}), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(pixel(1, 8, PHOTOMETRIC_MINISWHITE, {7, 200}), cv::Vec3b(55, 55, 55));
  EXPECT_EQ(pixel(2, 8, PHOTOMETRIC_MINISBLACK, {7, 1, 200, 2}), cv::Vec3b(200, 200, 200))
      << "alpha dropped";
  EXPECT_EQ(pixel(1, 8, PHOTOMETRIC_PALETTE, {0, 100}), cv::Vec3b(50, 155, 100));
  EXPECT_EQ(pixel(4, 8, PHOTOMETRIC_RGB, {0, 0, 0, 0, 10, 20, 30, 5}), cv::Vec3b(30, 20, 10))
      << "alpha dropped";
  const uint16_t samples[6] = {0, 0, 0, 10 * 257, 20 * 257, 30 * 257};
  std::vector<uint8_t> row(sizeof(samples));
  std::memcpy(row.data(), samples, sizeof(samples));
  EXPECT_EQ(pixel(3, 16, PHOTOMETRIC_RGB, row), cv::Vec3b(30, 20, 10));
  const uint16_t grays[2] = {0, 200 * 257};
  row.resize(sizeof(grays));
  std::memcpy(row.data(), grays, sizeof(grays));
  EXPECT_EQ(pixel(1, 16, PHOTOMETRIC_MINISBLACK, row), cv::Vec3b(200, 200, 200));
}

TEST(DecodePhoto, TurnsJpegsUprightByExif) {
  const FileBytes plain = JpegFile(TestPicture(48, 32));
  const cv::Mat stored = DecodePhoto(plain, kLimits).bgr;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    for (const bool is_little_endian : {false, true}) {
      const FileBytes exif = testing::ExifBlock(orientation, is_little_endian);
      ExpectUpright(DecodePhoto(WithExif(plain, exif), kLimits), stored, orientation);
    }
  }
}

TEST(DecodePhoto, TurnsWebpsUprightByExif) {
  const cv::Mat picture = TestPicture(48, 32);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    FileBytes exif = testing::ExifBlock(orientation, true);
    ExpectUpright(DecodePhoto(testing::WebpFile(picture, true, exif), kLimits), picture,
                  orientation);
    exif.insert(exif.begin(), {'E', 'x', 'i', 'f', 0, 0});  // as some write it
    ExpectUpright(DecodePhoto(testing::WebpFile(picture, true, exif), kLimits), picture,
                  orientation);
  }
}

// As iPhones write them.
TEST(DecodePhoto, ReadsHeicsOfTiles) {
  const cv::Mat picture = TestPicture(300, 220);  // no whole number of tiles
  for (int angle = 0; angle < 4; ++angle) {
    const DecodedPhoto photo = DecodePhoto(testing::HeicGridFile(picture, 128, angle), kLimits);
    ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
    constexpr int kOrientations[] = {1, 8, 3, 6};  // of EXIF, that turn as far
    const cv::Mat upright = Upright(picture, kOrientations[angle]);
    ASSERT_EQ(photo.bgr.size(), upright.size()) << angle;
    EXPECT_LT(cv::norm(photo.bgr, upright, cv::NORM_L1) / (3 * picture.total()), 4.0) << angle;
  }
}

// HEIF has boxes for that, which libheif obeys; what EXIF says besides is not for readers.
TEST(DecodePhoto, TurnsHeifsUprightByTheirBoxes) {
  const cv::Mat picture = TestPicture(96, 64);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const DecodedPhoto photo = DecodePhoto(
        testing::HeifFileOf(picture, {.orientation = static_cast<heif_orientation>(orientation),
                                      .exif = testing::ExifBlock(6, true)}),
        kLimits);
    ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
    EXPECT_EQ(photo.orientation, 1);
    const cv::Mat upright = Upright(picture, orientation);
    ASSERT_EQ(photo.bgr.size(), upright.size()) << orientation;
    EXPECT_LT(cv::norm(photo.bgr, upright, cv::NORM_L1) / (3 * picture.total()), 4.0)
        << orientation;
  }
}

TEST(DecodePhoto, TurnsPngsAndTiffsUpright) {
  const cv::Mat picture = TestPicture(48, 32);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    ExpectUpright(DecodePhoto(PngFile(picture, false, orientation), kLimits), picture, orientation);
    TiffKind kind;
    kind.orientation = orientation;
    ExpectUpright(DecodePhoto(TiffFile(picture, kind), kLimits), picture, orientation);
  }
}

TEST(DecodePhoto, IgnoresSenselessExif) {
  const FileBytes plain = JpegFile(TestPicture(48, 32));
  const cv::Mat stored = DecodePhoto(plain, kLimits).bgr;
  ExpectUpright(DecodePhoto(WithExif(plain, testing::ExifBlock(0, true)), kLimits), stored, 1);
  ExpectUpright(DecodePhoto(WithExif(plain, testing::ExifBlock(9, false)), kLimits), stored, 1);
  ExpectUpright(DecodePhoto(WithExif(plain, {}), kLimits), stored, 1);
  const FileBytes exif = testing::ExifBlock(6, true);
  for (size_t length = 0; length < exif.size();
       ++length) {  // cut anywhere: turned or not, but decoded
    const DecodedPhoto photo =
        DecodePhoto(WithExif(plain, FileBytes(exif.begin(), exif.begin() + length)), kLimits);
    EXPECT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
  }
  FileBytes far = exif;
  far[4] = far[5] = far[6] = far[7] = 0xFF;  // the directory's offset
  ExpectUpright(DecodePhoto(WithExif(plain, far), kLimits), stored, 1);
  // Another APP1 first (XMP), then EXIF: found all the same. Fill bytes before a marker are
  // allowed.
  const FileBytes xmp_first = WithSegment(WithExif(plain, exif), 0xE1, {'h', 't', 't', 'p'});
  ExpectUpright(DecodePhoto(xmp_first, kLimits), stored, 6);
  FileBytes filled = WithExif(plain, exif);
  filled.insert(filled.begin() + 2, {0xFF, 0xFF});
  ExpectUpright(DecodePhoto(filled, kLimits), stored, 6);
  // A damaged eXIf chunk does not turn a PNG.
  FileBytes png = PngFile(TestPicture(48, 32), false, 6);
  const std::string_view text(reinterpret_cast<const char*>(png.data()), png.size());
  const size_t chunk = text.find("eXIf");
  ASSERT_NE(chunk, std::string_view::npos);
  png[chunk + 4 + 31] = 3;  // the orientation's low byte, without a new checksum
  EXPECT_EQ(DecodePhoto(png, kLimits).orientation, 1);
}

TEST(DecodePhoto, PicksTheLayoutOfTheSizeWanted) {
  const FileBytes plain = JpegFile(TestPicture(48, 32));
  const cv::Mat stored = DecodePhoto(plain, kLimits).bgr;
  const FileBytes turned = WithExif(plain, testing::ExifBlock(6, true));
  ExpectUpright(DecodePhoto(turned, kLimits, {32, 48}), stored, 6);
  const DecodedPhoto as_stored = DecodePhoto(turned, kLimits, {48, 32});
  ASSERT_EQ(as_stored.outcome, DecodeOutcome::kDecoded) << as_stored.detail;
  EXPECT_EQ(as_stored.layout, PhotoLayout::kAsStored);
  EXPECT_EQ(LargestDifference(as_stored.bgr, stored), 0);
  EXPECT_EQ(as_stored.upright_size, (ImageSize{32, 48}));
  const DecodedPhoto wrong = DecodePhoto(turned, kLimits, {640, 480});
  EXPECT_EQ(wrong.outcome, DecodeOutcome::kWrongSize);
  EXPECT_EQ(wrong.detail, "the photo has 32x48 px (stored as 48x32), the camera 640x480");
  EXPECT_TRUE(wrong.bgr.empty());
  EXPECT_EQ(DecodePhoto(plain, kLimits, {32, 48}).outcome, DecodeOutcome::kWrongSize);
  EXPECT_EQ(DecodePhoto(plain, kLimits, {32, 48}).detail,
            "the photo has 48x32 px, the camera 32x48");
}

void ExpectRefused(const FileBytes& bytes, DecodeOutcome outcome, const std::string& expected) {
  const DecodedPhoto photo = DecodePhoto(bytes, kLimits);
  EXPECT_EQ(photo.outcome, outcome) << photo.detail;
  EXPECT_NE(photo.detail.find(expected), std::string::npos) << photo.detail;
  EXPECT_TRUE(photo.bgr.empty());
  EXPECT_TRUE(photo.gray.empty());
}

FileBytes Text(std::string_view text) {
  return FileBytes(text.begin(), text.end());
}

TEST(DecodePhoto, RefusesAvifs) {
  FileBytes avif = testing::HeifFileOf(TestPicture(98, 66), {.compression = heif_compression_AV1});
  ASSERT_FALSE(avif.empty()) << "Debian's libheif writes AVIF";
  ExpectRefused(avif, DecodeOutcome::kUnsupportedFormat, "an AVIF; save it as a JPEG");
  std::copy_n("heic", 4, avif.begin() + 8);  // the brand
  ExpectRefused(avif, DecodeOutcome::kUnsupportedFormat, "AV1, as an AVIF");
}

TEST(DecodePhoto, RefusesWhatIsNoPhoto) {
  ExpectRefused({}, DecodeOutcome::kEmpty, "empty");
  ExpectRefused({0xFF}, DecodeOutcome::kUnsupportedFormat, "not a JPEG");
  ExpectRefused(Text("Dear diary, today I took no photograph.\n"),
                DecodeOutcome::kUnsupportedFormat, "not a JPEG");
  ExpectRefused(Text("BM\x46\0\0\0"), DecodeOutcome::kUnsupportedFormat, "not a JPEG");
  ExpectRefused(Text("GIF89a\1\0\1\0"), DecodeOutcome::kUnsupportedFormat, "not a JPEG");
  ExpectRefused(FileBytes(100'000, 0), DecodeOutcome::kUnsupportedFormat, "not a JPEG");
  ExpectRefused({'I', 'I', '+', 0, 8, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0},
                DecodeOutcome::kUnsupportedFormat, "BigTIFF");
  ExpectRefused({0xFF, 0xD8, 0xFF}, DecodeOutcome::kUnreadable, "JPEG");
  ExpectRefused({0xFF, 0xD8, 0xFF, 0xD9, 0, 0, 0, 0}, DecodeOutcome::kUnreadable,
                "no frame header");
  ExpectRefused({0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'}, DecodeOutcome::kUnreadable, "PNG");
  ExpectRefused({'I', 'I', '*', 0}, DecodeOutcome::kUnreadable, "TIFF");
  ExpectRefused(Text("RIFF    WEBPVP8 "), DecodeOutcome::kUnreadable, "WebP");
  ExpectRefused(Text("RIFF    WAVEfmt "), DecodeOutcome::kUnsupportedFormat, "not a JPEG");
  FileBytes film = testing::HeifFileOf(TestPicture(64, 64));
  std::copy_n("isom", 4, film.begin() + 8);  // the brand
  ExpectRefused(film, DecodeOutcome::kUnsupportedFormat, "not a JPEG");
  FileBytes heif = testing::HeifFileOf(TestPicture(64, 64));
  heif.resize(40);
  ExpectRefused(heif, DecodeOutcome::kUnreadable, "HEIF");
  ExpectRefused({'M', 'M', 0, '*', 0, 0, 0, 8, 0, 0}, DecodeOutcome::kUnreadable,
                "declares no pixels");
}

TEST(DecodePhoto, RefusesKindsThatAreNotRead) {
  ExpectRefused(testing::CmykJpegFile(16, 16), DecodeOutcome::kUnsupportedFormat, "CMYK");
  FileBytes jpeg = JpegFile(TestPicture(16, 16));
  const auto frame =
      std::search(jpeg.begin(), jpeg.end(), std::begin("\xFF\xC0"), std::begin("\xFF\xC0") + 2,
                  [](uint8_t a, char b) { return a == static_cast<uint8_t>(b); });
  ASSERT_NE(frame, jpeg.end());
  FileBytes other = jpeg;
  other[frame - jpeg.begin() + 4] = 12;
  ExpectRefused(other, DecodeOutcome::kUnsupportedFormat, "12 bits");
  other = jpeg;
  other[frame - jpeg.begin() + 1] = 0xC9;
  ExpectRefused(other, DecodeOutcome::kUnsupportedFormat, "arithmetic");
  other = jpeg;
  other[frame - jpeg.begin() + 5] = other[frame - jpeg.begin() + 6] = 0;
  ExpectRefused(other, DecodeOutcome::kUnreadable, "no pixels");
  const std::vector<uint8_t> rows(16 * 16 * 8, 1);
  ExpectRefused(TiffFile(16, 16, {1, 32, PHOTOMETRIC_MINISBLACK}, rows),
                DecodeOutcome::kUnsupportedFormat, "32 bits");
  ExpectRefused(TiffFile(16, 16, {4, 8, PHOTOMETRIC_SEPARATED}, rows),
                DecodeOutcome::kUnsupportedFormat, "colours of kind 5");
  TiffKind floats{1, 32, PHOTOMETRIC_MINISBLACK};
  floats.sample_format = SAMPLEFORMAT_IEEEFP;
  ExpectRefused(TiffFile(16, 16, floats, rows), DecodeOutcome::kUnsupportedFormat,
                "no whole numbers");
  TiffKind jpeg_inside{3, 8, PHOTOMETRIC_RGB, COMPRESSION_JPEG};
  jpeg_inside.rows_per_strip = 16;
  ExpectRefused(TiffFile(16, 16, jpeg_inside, rows), DecodeOutcome::kUnsupportedFormat,
                "compression 7");
}

TEST(DecodePhoto, ToleratesPaddingButNotLossAtTheEnd) {
  const FileBytes jpeg = JpegFile(TestPicture(64, 48));
  const cv::Mat picture = DecodePhoto(jpeg, kLimits).bgr;
  FileBytes trailed = jpeg;
  trailed.insert(trailed.end(), 5000, 0xAB);  // what phones append behind the picture
  EXPECT_EQ(LargestDifference(DecodePhoto(trailed, kLimits).bgr, picture), 0);
  FileBytes padded = jpeg;
  padded.insert(padded.end() - 2, 10, 0);  // what some phones put in front of the end
  const DecodedPhoto photo = DecodePhoto(padded, kLimits);
  ASSERT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
  EXPECT_EQ(LargestDifference(photo.bgr, picture), 0);
  FileBytes lost = jpeg;
  lost.erase(lost.end() - 40, lost.end() - 2);
  ExpectRefused(lost, DecodeOutcome::kUnreadable, "cut short or damaged");
  EXPECT_NE(DecodePhoto(FileBytes(jpeg.begin(), jpeg.end() - 2), kLimits).outcome,
            DecodeOutcome::kDecoded);
}

TEST(DecodePhoto, ToleratesNoPaddingWhereRowsMayHide) {
  // With restart markers, rows that are missing at the end look like padding in front of the end
  // marker.
  const cv::Mat picture = TestPicture(64, 48);
  setenv("TJ_RESTART", "1",
         1);  // TurboJPEG's own switch: a restart marker after each row of blocks
  const FileBytes jpeg = JpegFile(picture);
  unsetenv("TJ_RESTART");
  const std::string_view text(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
  ASSERT_NE(text.find("\xFF\xDD"), std::string_view::npos) << "has restart markers";
  EXPECT_EQ(DecodePhoto(jpeg, kLimits).outcome, DecodeOutcome::kDecoded);
  const size_t second_row = text.find("\xFF\xD0");
  ASSERT_NE(second_row, std::string_view::npos);
  FileBytes lost(jpeg.begin(), jpeg.begin() + second_row);
  lost.insert(lost.end(), {0, 0, 0, 0, 0, 0, 0xFF, 0xD9});
  ExpectRefused(lost, DecodeOutcome::kUnreadable, "cut short or damaged");
}

TEST(DecodePhoto, KeepsItsLimits) {
  const FileBytes jpeg = JpegFile(TestPicture(48, 32));
  DecodeLimits limits;
  limits.size_bytes_max = jpeg.size();
  EXPECT_EQ(DecodePhoto(jpeg, limits).outcome, DecodeOutcome::kDecoded);
  limits.size_bytes_max = jpeg.size() - 1;
  EXPECT_EQ(DecodePhoto(jpeg, limits).outcome, DecodeOutcome::kTooLarge);
  limits = {};
  limits.pixels_max = 48 * 32;
  EXPECT_EQ(DecodePhoto(jpeg, limits).outcome, DecodeOutcome::kDecoded);
  limits.pixels_max = 48 * 32 - 1;
  EXPECT_EQ(DecodePhoto(jpeg, limits).outcome, DecodeOutcome::kTooLarge);
  limits = {};
  limits.side_px_max = 47;
  EXPECT_EQ(DecodePhoto(jpeg, limits).outcome, DecodeOutcome::kTooLarge);
  EXPECT_NE(DecodePhoto(jpeg, limits).detail.find("48x32"), std::string::npos);
  limits.side_px_max = 0;
  EXPECT_FALSE(limits.Check().ok());
  EXPECT_EQ(DecodePhoto(jpeg, limits).outcome, DecodeOutcome::kTooLarge);
}

TEST(DecodePhoto, ReadsEveryRealPhoto) {
  const std::filesystem::path folder = std::filesystem::path(VEDUTA_TEST_DATA) / "streets";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no real photos here";
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".jpg") continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const FileBytes bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    const DecodedPhoto photo = DecodePhoto(bytes, kLimits);
    EXPECT_EQ(photo.outcome, DecodeOutcome::kDecoded) << entry.path() << ": " << photo.detail;
    ++count;
  }
  EXPECT_GT(count, 10);
}

}  // namespace
}  // namespace veduta
