// SPDX-License-Identifier: Apache-2.0
#pragma once
// A contributed file's bytes to pixels. The bytes are not trusted.

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/camera/photo_header.h"
#include "engine/camera/private_areas.h"
#include "storage/base/status.h"
#include "storage/model/image_size.h"

namespace veduta {

class PhotoDecoder;

// What a photo may be at most. The defaults are chosen by hand: larger than the photos of any
// camera that we know of, small enough that hostile files cannot exhaust the memory.
struct DecodeLimits {
  uint64_t size_bytes_max = 256ull << 20;  // bytes of the file; >= 1
  // >= 1. Bounds the memory: decoding takes at most 16 bytes for each pixel.
  uint64_t pixels_max = 200'000'000;
  uint32_t side_px_max = 32768;  // px of the longer side; [1, 65535], as in CameraModel

  Status Check() const;  // the first violated bound, named with its value
};

enum class DecodeOutcome : uint8_t {
  kDecoded,
  kEmpty,  // no bytes
  // Not a JPEG, PNG, TIFF, WebP or HEIF, or a kind of these that is not read. The file may be
  // sound.
  kUnsupportedFormat,
  kUnreadable,  // one of these, but cut short or damaged
  // Over a limit. The file's size or its header says so: nothing was decoded.
  kTooLarge,
  // Not of the size wanted. The header is sound; nothing was decoded.
  kWrongSize,
  kNoMemory,  // the machine has too little memory: this says nothing about the photo
};

// Which way round the pixels are.
enum class PhotoLayout : uint8_t { kUpright, kAsStored };

// The pixels that a camera has.
struct WantedPixels {
  ImageSize size;  // empty: of any size, upright
  // Of the two ways round, where the photo has this size in both: half a turn keeps it.
  PhotoLayout preferred = PhotoLayout::kAsStored;
};

// What is preferred of a stored image, by its record's `orientation`: the way round that it was
// decoded when it was added. A program that noted none preferred the upright photo.
inline PhotoLayout StoredLayout(uint8_t orientation) {
  return orientation > 1 ? PhotoLayout::kAsStored : PhotoLayout::kUpright;
}

struct DecodedPhoto {
  DecodeOutcome outcome = DecodeOutcome::kEmpty;
  std::string detail;  // why not kDecoded, for a person; empty if kDecoded
  PhotoFormat format = PhotoFormat::kUnknown;
  int orientation = 1;                         // EXIF's, [1, 8]
  ImageSize stored_size, upright_size;         // zero if the header was not read
  PhotoLayout layout = PhotoLayout::kUpright;  // of the images below
  cv::Mat bgr;                                 // CV_8UC3, blue first; empty unless kDecoded
  cv::Mat gray;  // CV_8UC1 by GrayFromBgr's formula; empty unless kDecoded
  std::vector<PixelArea> private_areas = {};  // of these images, which are filled there

  // How these images are turned to stand upright, as ImageRecord::orientation.
  uint8_t images_orientation() const {
    return layout == PhotoLayout::kUpright ? 1 : static_cast<uint8_t>(orientation);
  }
};

// Decodes a JPEG, PNG, TIFF (its first page), WebP or HEIF (its primary picture), recognised by its
// content, never by a name. More than 8 bits are rounded to 8, grey becomes three equal channels,
// palettes are looked up, alpha is dropped, colour profiles are ignored. Other kinds (CMYK, 12 bits
// in a JPEG, floats, JPEG inside TIFF, AVIF ...) are kUnsupportedFormat with the reason.
//
// `wanted` is the camera's. Where both the photo as it is stored and the photo that its EXIF
// orientation turns upright have the size, the preferred of them is returned. As stored is how the
// camera's sensor sees, whichever way round it is held: its principal point and its lens are of
// those pixels. Pixels that are stored mirrored show no place that there is: upright is preferred
// of them. Where one alone has the size it is returned, and where none has it the photo is
// kWrongSize.
//
// Deterministic; one thread; thread-safe. Never throws, never prints. Limits that Check refuses
// are reported as kTooLarge.
DecodedPhoto DecodePhoto(std::span<const uint8_t> bytes, const DecodeLimits& limits,
                         WantedPixels wanted = {});
// The same by a decoder that may be another process, of a photo that it has examined. Whatever it
// answers, the result is of the size that the header has.
DecodedPhoto DecodePhoto(const PhotoDecoder& decoder, std::span<const uint8_t> bytes,
                         const PhotoHeader& header, const DecodeLimits& limits,
                         WantedPixels wanted = {});

}  // namespace veduta
