// SPDX-License-Identifier: Apache-2.0
#pragma once
// A contributed file's bytes to pixels. The bytes are not trusted.

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <string>

#include "engine/camera/photo_header.h"
#include "storage/base/status.h"
#include "storage/model/image_size.h"

namespace veduta {

struct DecodeLimits {
  uint64_t size_bytes_max = 256ull << 20;  // >= 1; of the file
  uint64_t pixels_max =
      200'000'000;               // >= 1; bounds memory: 16 bytes a pixel at most while decoding
  uint32_t side_px_max = 32768;  // [1, 65535]

  Status Check() const;
};

enum class DecodeOutcome : uint8_t {
  kDecoded,
  kEmpty,              // no bytes
  kUnsupportedFormat,  // not a JPEG, PNG or TIFF, or a kind of these that is not read; the file may
                       // be sound
  kUnreadable,         // one of these, but cut short or damaged
  kTooLarge,   // a limit is exceeded; said by the file's size or its header, before anything is
               // decoded
  kWrongSize,  // sound as far as its header tells, but not of the size wanted; not decoded
};

// Which way round the pixels are.
enum class PhotoLayout : uint8_t { kUpright, kAsStored };

struct DecodedPhoto {
  DecodeOutcome outcome = DecodeOutcome::kEmpty;
  std::string detail;  // why not kDecoded, for a person; empty if kDecoded
  PhotoFormat format = PhotoFormat::kUnknown;
  int orientation = 1;                         // EXIF's, [1, 8]
  ImageSize stored_size, upright_size;         // zero if the header was not read
  PhotoLayout layout = PhotoLayout::kUpright;  // of the images below
  cv::Mat bgr;                                 // CV_8UC3, blue first; empty unless kDecoded
  cv::Mat gray;                                // CV_8UC1 by GrayFromBgr's formula; likewise
};

// Decodes a JPEG, PNG or TIFF (its first page), recognised by its content, never by a name. 16-bit
// samples are rounded to 8, grey becomes three equal channels, palettes are looked up, alpha is
// dropped, colour profiles are ignored. Other kinds (CMYK, 12 bits, floats, JPEG inside TIFF ...)
// are kUnsupportedFormat with the reason.
//
// `wanted` is the camera's size. If the photo turned upright by its EXIF orientation has it, that
// is what is returned; otherwise, if the photo as stored has it, the stored pixels (a camera
// calibrated on files read without EXIF); otherwise kWrongSize. An empty `wanted` takes any size
// and returns the photo upright.
//
// Deterministic; one thread; thread-safe. Never throws, never prints. Limits that Check refuses,
// and a want of memory, are reported as kTooLarge.
DecodedPhoto DecodePhoto(std::span<const uint8_t> bytes, const DecodeLimits& limits,
                         ImageSize wanted = {});

}  // namespace veduta
