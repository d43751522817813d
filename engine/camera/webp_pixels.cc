// SPDX-License-Identifier: Apache-2.0
#include <webp/decode.h>

#include "engine/camera/pixel_decoders.h"

namespace veduta {

// Alpha is dropped, as in PNG.
Pixels DecodeWebpPixels(std::span<const uint8_t> bytes, const PhotoHeader& header) {
  WebPDecoderConfig config;
  if (!WebPInitDecoderConfig(&config))
    return {PixelOutcome::kUnsupportedFormat, "libwebp is of another version than its headers", {}};
  cv::Mat bgr(static_cast<int>(header.stored_size.height_px),
              static_cast<int>(header.stored_size.width_px), CV_8UC3);
  config.output.colorspace = MODE_BGR;
  config.output.is_external_memory = 1;
  config.output.u.RGBA = {bgr.data, static_cast<int>(bgr.step[0]), bgr.total() * bgr.elemSize()};
  const VP8StatusCode status = WebPDecode(bytes.data(), bytes.size(), &config);
  WebPFreeDecBuffer(&config.output);
  switch (status) {
    case VP8_STATUS_OK:
      return {PixelOutcome::kDecoded, {}, std::move(bgr)};
    case VP8_STATUS_OUT_OF_MEMORY:
      return {PixelOutcome::kNoMemory, {}, {}};
    case VP8_STATUS_UNSUPPORTED_FEATURE:
      return {PixelOutcome::kUnsupportedFormat,
              "a WebP of a kind that is not read; save it as a JPEG",
              {}};
    default:
      return {PixelOutcome::kUnreadable, "the WebP is cut short or damaged", {}};
  }
}

}  // namespace veduta
