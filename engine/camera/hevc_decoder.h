// SPDX-License-Identifier: Apache-2.0
#pragma once
// The decoder of HEVC that libheif is to use for iPhones' photos (HEIC). It is libde265, called
// such that the same bytes give the same pixels.
//
// libheif's own way of calling libde265 takes any picture that comes out. libde265 leaves those
// parts of a picture as they are in memory that no slice of a damaged file covers, and it does not
// say so. This decoder therefore decodes twice. The first time it does so without the filters, into
// planes that are full of a pattern, and refuses the file where any block of 4 x 4 samples still is
// the pattern. The second time is for the picture. A sound picture has the pattern only where
// someone made it so.

#include <cstdint>

namespace veduta {

// Registers the decoder with libheif, in front of libheif's own, at the first call. Registers with
// it a decoder of AV1 that refuses every picture: libheif's own have no bound for the memory that a
// bitstream claims, and 520 bytes that declare 40 x 28 px took 3.4 GB. Thread-safe. Throws
// std::bad_alloc.
void RegisterHevcDecoder();

// While one of these lives, the calling thread decodes no coded picture of more than
// `pixels_max` pixels: a bitstream may claim more than its file does. 200,000,000 where none lives.
class HevcPixelLimit final {
 public:
  explicit HevcPixelLimit(uint64_t pixels_max);
  ~HevcPixelLimit();
  HevcPixelLimit(const HevcPixelLimit&) = delete;
  HevcPixelLimit& operator=(const HevcPixelLimit&) = delete;

 private:
  const uint64_t outer_pixels_max_;
};

}  // namespace veduta
