// SPDX-License-Identifier: Apache-2.0
#pragma once
// Who runs the libraries that read photos. Their bytes are not trusted, and the libraries have
// faults: a program that takes photos of strangers has them decoded in other processes
// (engine/camera/sandbox/).

#include <cstdint>
#include <optional>
#include <span>

#include "engine/camera/exif.h"
#include "engine/camera/photo_header.h"
#include "engine/camera/pixel_decoders.h"

namespace veduta {

// What a photo says of itself before anything is decoded.
struct PhotoExamination {
  PhotoHeader header;  // without its block of EXIF
  ExifCamera camera;
  std::optional<GpsFix> gps;
  std::optional<TakenTime> taken;
};

// Ends of processes that had a photo to read.
struct DecoderDeaths {
  uint64_t by_photos = 0;  // that the photo has brought about, or that took too long or too much
  uint64_t by_others = 0;  // that were killed from outside, as by the system where memory is short
};

// Whatever a photo does to the decoder is told by an outcome. Thread-safe; never throws, except
// std::bad_alloc and cv::Exception for want of memory.
class PhotoDecoder {
 public:
  virtual ~PhotoDecoder() = default;

  // ReadPhotoHeader, ReadExifCamera, ReadExifGps and ReadExifTaken.
  virtual PhotoExamination Examine(std::span<const uint8_t> bytes) const = 0;
  // The pixels as stored, of header.stored_size, which the caller has found to be within limits.
  virtual Pixels DecodePixels(std::span<const uint8_t> bytes, const PhotoHeader& header) const = 0;
  // What handing over a photo takes, besides what decoding takes itself (DecodeLimits).
  virtual uint64_t HandoverBytes(uint64_t size_bytes, uint64_t pixel_count) const = 0;
  // Since it was made; none where photos are read in this process.
  virtual DecoderDeaths deaths() const { return {}; }
};

// Decodes on the thread that calls.
const PhotoDecoder& DecoderInProcess();

}  // namespace veduta
