// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a photo's file says about itself before anything is decoded. No decoder sees a file that
// this refuses.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "storage/model/image_size.h"

namespace veduta {

enum class PhotoFormat : uint8_t { kUnknown, kJpeg, kPng, kTiff, kWebp, kHeif };

// What a file of another kind is told.
inline constexpr const char* kNoPhotoText = "the file is not a JPEG, PNG, TIFF, WebP or HEIC";

// "image/jpeg" and so on.
const char* MediaTypeOf(PhotoFormat format);

enum class HeaderOutcome : uint8_t { kRead, kUnsupportedFormat, kUnreadable, kNoMemory };

struct PhotoHeader {
  HeaderOutcome outcome = HeaderOutcome::kUnreadable;
  std::string detail;  // why not kRead, for a person
  PhotoFormat format = PhotoFormat::kUnknown;
  ImageSize stored_size;       // as the sensor wrote it (HEIF: upright); both sides > 0 if kRead
  int orientation = 1;         // 1 to 8 as EXIF numbers them; 1 if absent or senseless, and of HEIF
  int sensor_orientation = 1;  // how the camera was held: the same, and of HEIF what its EXIF says
  bool has_restarts = false;   // JPEG: restart markers between its rows
  // The block of EXIF, of 64 KiB at most; of a TIFF what it tells itself (ExifOfTiff). Empty where
  // there is none.
  std::vector<uint8_t> exif;
};

// Recognises JPEG (baseline, extended and progressive Huffman, 8 bits, grey or three components),
// PNG, classic TIFF, WebP (one picture, no film) and HEIF (HEIC; no AVIF) by their signatures, and
// reads size and orientation: EXIF's in JPEG's APP1, PNG's eXIf and WebP's EXIF, the tag in TIFF.
// Looks at JPEG's segments up to the first scan, at PNG's and WebP's chunk headers, at TIFF's first
// directory, and has libheif read HEIF's boxes. Thread-safe.
PhotoHeader ReadPhotoHeader(std::span<const uint8_t> bytes);

}  // namespace veduta
