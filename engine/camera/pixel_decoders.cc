// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/pixel_decoders.h"

namespace veduta {

Pixels DecodePixels(std::span<const uint8_t> bytes, const PhotoHeader& header) {
  switch (header.format) {
    case PhotoFormat::kJpeg:
      return DecodeJpegPixels(bytes, header);
    case PhotoFormat::kPng:
      return DecodePngPixels(bytes, header);
    case PhotoFormat::kTiff:
      return DecodeTiffPixels(bytes, header);
    case PhotoFormat::kWebp:
      return DecodeWebpPixels(bytes, header);
    case PhotoFormat::kHeif:
      return DecodeHeifPixels(bytes, header);
    case PhotoFormat::kUnknown:
      break;
  }
  return {PixelOutcome::kUnsupportedFormat, kNoPhotoText, {}};
}

}  // namespace veduta
