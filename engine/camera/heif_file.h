// SPDX-License-Identifier: Apache-2.0
#pragma once
// HEIF, the container of iPhones' photos (HEIC) and of AVIF, as libheif reads it.

#include <libheif/heif.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "storage/model/image_size.h"

namespace veduta {

struct HeifDeleter {
  void operator()(heif_context* context) const { heif_context_free(context); }
  void operator()(heif_image_handle* handle) const { heif_image_handle_release(handle); }
  void operator()(heif_image* image) const { heif_image_release(image); }
  void operator()(heif_decoding_options* options) const { heif_decoding_options_free(options); }
};

enum class HeifOutcome : uint8_t { kRead, kUnsupported, kUnreadable, kNoMemory };

struct HeifFailure {
  HeifOutcome outcome = HeifOutcome::kRead;
  std::string detail;  // for a person; empty where kRead
};
HeifFailure FailureOf(const heif_error& error);

// A file whose boxes were read. No picture is decoded yet.
struct HeifFile {
  HeifFailure failure;
  std::unique_ptr<heif_context, HeifDeleter> context;
  std::unique_ptr<heif_image_handle, HeifDeleter> primary;  // null unless kRead

  // Upright: what the file says of turning and cropping is done. Its EXIF says nothing of that.
  ImageSize Size() const;
  // Before cropping.
  uint64_t PixelCount() const;
  // What each of the coded pictures that make up the primary may have at most.
  uint64_t CodedPixelsMax() const;
  // What either side of any picture may have at most that the primary is made from, px.
  int CanvasSideMax() const;
  // The block of EXIF; empty where there is none of 64 KiB at most.
  std::vector<uint8_t> Exif() const;
};

// Whether the bytes are a HEIF with pictures, and not a film or another file of boxes.
bool IsHeif(std::span<const uint8_t> bytes);
// The bytes must outlive the file. A file that claims pictures of more than 65535 px a side is
// kUnreadable.
HeifFile OpenHeif(std::span<const uint8_t> bytes);

}  // namespace veduta
