// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/decoder.h"

namespace veduta {
namespace {

class InProcess final : public PhotoDecoder {
 public:
  PhotoExamination Examine(std::span<const uint8_t> bytes) const override {
    PhotoExamination found;
    found.header = ReadPhotoHeader(bytes);
    found.camera = ReadExifCamera(found.header.exif);
    found.gps = ReadExifGps(found.header.exif);
    found.taken = ReadExifTaken(found.header.exif);
    found.header.exif.clear();
    return found;
  }
  Pixels DecodePixels(std::span<const uint8_t> bytes, const PhotoHeader& header) const override {
    return veduta::DecodePixels(bytes, header);
  }
  uint64_t HandoverBytes(uint64_t, uint64_t) const override { return 0; }
};

}  // namespace

const PhotoDecoder& DecoderInProcess() {
  static const InProcess decoder;
  return decoder;
}

}  // namespace veduta
