// SPDX-License-Identifier: Apache-2.0
#include <turbojpeg.h>

#include <memory>
#include <string_view>

#include "engine/camera/pixel_decoders.h"

namespace veduta {
namespace {

struct DestroyHandle {
  void operator()(void* handle) const { tjDestroy(handle); }
};

// Some phones pad the picture's end; libjpeg warns of it. It is harmless if no picture data is
// missing: then the first warning is about bytes before the end marker (0xd9). With restart markers
// the same words may stand for lost rows.
bool IsHarmless(std::string_view warning, const PhotoHeader& header) {
  return !header.has_restarts &&
         warning.find("extraneous bytes before marker 0xd9") != std::string_view::npos;
}

// libjpeg's and TurboJPEG's words where malloc has returned nothing.
bool IsShortage(std::string_view reason) {
  return reason.find("Insufficient memory") != std::string_view::npos ||
         reason.find("Memory allocation failure") != std::string_view::npos;
}

}  // namespace

// libjpeg fills what is missing with grey and only warns; the first warning ends the decoding here.
// Its slow-but-exact integer transform is the default and gives the same pixels on every vector
// unit.
Pixels DecodeJpegPixels(std::span<const uint8_t> bytes, const PhotoHeader& header) {
  const std::unique_ptr<void, DestroyHandle> handle(tjInitDecompress());
  if (handle == nullptr) return {PixelOutcome::kNoMemory, "", {}};
  const int width = static_cast<int>(header.stored_size.width_px);
  const int height = static_cast<int>(header.stored_size.height_px);
  cv::Mat bgr(height, width, CV_8UC3);
  // Width and height bound what is written, whatever the file says.
  const auto decode = [&](int flags) {
    return tjDecompress2(handle.get(), bytes.data(), static_cast<unsigned long>(bytes.size()),
                         bgr.data, width, static_cast<int>(bgr.step[0]), height, TJPF_BGR,
                         flags | TJFLAG_LIMITSCANS);
  };
  if (decode(TJFLAG_STOPONWARNING) == 0) return {PixelOutcome::kDecoded, "", std::move(bgr)};
  std::string reason = tjGetErrorStr2(handle.get());
  if (tjGetErrorCode(handle.get()) == TJERR_WARNING && IsHarmless(reason, header)) {
    // Once more to the end. An error after the warning would be reported as a warning too, but with
    // other words.
    if (decode(0) == 0) return {PixelOutcome::kDecoded, "", std::move(bgr)};
    reason = tjGetErrorStr2(handle.get());
    if (IsHarmless(reason, header)) return {PixelOutcome::kDecoded, "", std::move(bgr)};
  }
  if (IsShortage(reason)) return {PixelOutcome::kNoMemory, "", {}};
  return {PixelOutcome::kUnreadable, "the JPEG is cut short or damaged (" + reason + ")", {}};
}

}  // namespace veduta
