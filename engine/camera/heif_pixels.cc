// SPDX-License-Identifier: Apache-2.0
#include <new>
#include <opencv2/imgproc.hpp>

#include "engine/camera/heif_file.h"
#include "engine/camera/hevc_decoder.h"
#include "engine/camera/pixel_decoders.h"

namespace veduta {
namespace {

Pixels Refused(HeifFailure failure) {
  switch (failure.outcome) {
    case HeifOutcome::kUnsupported:
      return {PixelOutcome::kUnsupportedFormat, std::move(failure.detail), {}};
    case HeifOutcome::kNoMemory:
      return {PixelOutcome::kNoMemory, {}, {}};
    case HeifOutcome::kRead:
    case HeifOutcome::kUnreadable:
      break;
  }
  return {PixelOutcome::kUnreadable, std::move(failure.detail), {}};
}

// Whether the machine has what DecodeLimits promises that decoding takes at most. libheif does not
// tell a shortage of memory from a kind of colours that it cannot convert, and turns a picture
// without looking whether it got memory for it: 1.15.1 then ends the process.
bool HasMemory(const HeifFile& file) {
  constexpr uint64_t kBytesPerPixel = 16;
  // Called by name, for a compiler may leave out malloc and free, and a new expression.
  const uint64_t size_bytes = kBytesPerPixel * file.PixelCount();
  void* const all = ::operator new(size_bytes, std::nothrow);
  ::operator delete(all);
  return all != nullptr;
}

}  // namespace

Pixels DecodeHeifPixels(std::span<const uint8_t> bytes, const PhotoHeader& header) {
  const HeifFile file = OpenHeif(bytes);
  if (!file.primary) return Refused(file.failure);
  if (!HasMemory(file)) return {PixelOutcome::kNoMemory, {}, {}};
  const std::unique_ptr<heif_decoding_options, HeifDeleter> options(heif_decoding_options_alloc());
  if (!options) return {PixelOutcome::kNoMemory, {}, {}};
  options->convert_hdr_to_8bit = 1;
  options->strict_decoding = 1;
  const HevcPixelLimit limit(file.CodedPixelsMax());
  // A grid may claim a larger picture than the file does.
  heif_context_set_maximum_image_size_limit(file.context.get(), file.CanvasSideMax());
  heif_image* decoded = nullptr;
  const heif_error error = heif_decode_image(file.primary.get(), &decoded, heif_colorspace_RGB,
                                             heif_chroma_interleaved_RGB, options.get());
  const std::unique_ptr<heif_image, HeifDeleter> image(decoded);
  if (error.code != heif_error_Ok) return Refused(FailureOf(error));
  const auto width_px = static_cast<int>(header.stored_size.width_px);
  const auto height_px = static_cast<int>(header.stored_size.height_px);
  int stride = 0;
  const uint8_t* const rows =
      heif_image_get_plane_readonly(image.get(), heif_channel_interleaved, &stride);
  if (rows == nullptr || heif_image_get_primary_width(image.get()) != width_px ||
      heif_image_get_primary_height(image.get()) != height_px) {
    return {
        PixelOutcome::kUnreadable, "the HEIF's picture is not of the size that it declares", {}};
  }
  const cv::Mat rgb(height_px, width_px, CV_8UC3, const_cast<uint8_t*>(rows),
                    static_cast<size_t>(stride));
  Pixels pixels{PixelOutcome::kDecoded, {}, {}};
  cv::cvtColor(rgb, pixels.bgr, cv::COLOR_RGB2BGR);
  return pixels;
}

}  // namespace veduta
