// SPDX-License-Identifier: Apache-2.0
// DecodePhoto on files of one format, which VEDUTA_FUZZ_FORMAT names as an ending.
#include "engine/camera/photo_decoder.h"
#include "tests/engine/camera/heif_grid_writer.h"
#include "tests/engine/camera/modern_writer.h"
#include "tests/engine/camera/photo_writer.h"
#include "tests/engine/camera/tiff_writer.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  const std::string format = VEDUTA_FUZZ_FORMAT;
  const cv::Mat picture = testing::TestPicture(40, 28);
  if (format == "jpeg") {
    return {Text(testing::JpegFile(picture)), Text(testing::JpegFile(picture, TJFLAG_PROGRESSIVE)),
            Text(testing::JpegFile(picture, 0, TJSAMP_GRAY)),
            Text(testing::WithExif(testing::JpegFile(picture), testing::ExifBlock(6, true)))};
  }
  if (format == "png")
    return {Text(testing::PngFile(picture)), Text(testing::PngFile(picture, true, 8))};
  if (format == "webp") {
    return {Text(testing::WebpFile(picture)), Text(testing::WebpFile(picture, true)),
            Text(testing::WebpFile(picture, false, testing::ExifBlock(6, true)))};
  }
  if (format == "heif") {
    return {Text(testing::HeifFileOf(picture, {.exif = testing::ExifBlock(6, true)})),
            Text(testing::HeicGridFile(picture, 32, 1)),
            Text(testing::HeifFileOf(picture, {.orientation = heif_orientation_rotate_90_cw}))};
  }
  std::vector<std::string> seeds;
  for (const int compression :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
    for (const bool is_tiled : {false, true}) {
      testing::TiffKind kind;
      kind.compression = compression;
      kind.is_tiled = is_tiled;
      kind.orientation = 6;
      seeds.push_back(Text(testing::TiffFile(picture, kind)));
    }
  }
  return seeds;
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  veduta::DecodeLimits limits;
  limits.pixels_max = 1 << 16;  // small pictures show as much and take less time
  const veduta::DecodedPhoto photo = veduta::DecodePhoto({data, size}, limits);
  const bool is_decoded = photo.outcome == veduta::DecodeOutcome::kDecoded;
  Expect(is_decoded == !photo.bgr.empty() && is_decoded == !photo.gray.empty(),
         "there are pixels where the photo is decoded, and only there");
  Expect(is_decoded == photo.detail.empty(), "there is a reason where it is not decoded");
  if (is_decoded) {
    Expect(photo.bgr.total() <= limits.pixels_max, "a photo keeps to the limit");
    Expect(static_cast<uint32_t>(photo.bgr.cols) == photo.upright_size.width_px,
           "the pixels are as wide as is said");
  }
  return 0;
}
