// SPDX-License-Identifier: Apache-2.0
#pragma once
// The decoders behind DecodePhoto, one library each, in heif_pixels.cc, jpeg_pixels.cc,
// png_pixels.cc, tiff_pixels.cc and webp_pixels.cc. They expect a header that has been read and
// found within the limits. Nothing is printed and nothing thrown except std::bad_alloc and
// cv::Exception for want of memory.

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <string>

#include "engine/camera/photo_header.h"

namespace veduta {

enum class PixelOutcome : uint8_t { kDecoded, kUnsupportedFormat, kUnreadable, kNoMemory };

struct Pixels {
  PixelOutcome outcome = PixelOutcome::kUnreadable;
  std::string detail;  // why not kDecoded, for a person
  cv::Mat bgr;         // CV_8UC3 of header.stored_size, as stored (orientation not applied)
};

// By the decoder of the header's format.
Pixels DecodePixels(std::span<const uint8_t> bytes, const PhotoHeader& header);

Pixels DecodeJpegPixels(std::span<const uint8_t> bytes, const PhotoHeader& header);
Pixels DecodePngPixels(std::span<const uint8_t> bytes, const PhotoHeader& header);
Pixels DecodeTiffPixels(std::span<const uint8_t> bytes, const PhotoHeader& header);
Pixels DecodeWebpPixels(std::span<const uint8_t> bytes, const PhotoHeader& header);
Pixels DecodeHeifPixels(std::span<const uint8_t> bytes, const PhotoHeader& header);

}  // namespace veduta
