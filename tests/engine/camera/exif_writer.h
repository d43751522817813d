// SPDX-License-Identifier: Apache-2.0
#pragma once
// Blocks of EXIF, by exiv2.

#include <cmath>
#include <exiv2/exiv2.hpp>

#include "engine/camera/exif.h"
#include "tests/engine/camera/photo_writer.h"

namespace veduta::testing {

inline FileBytes BlockOf(const Exiv2::ExifData& data) {
  Exiv2::Blob blob;
  Exiv2::ExifParser::encode(blob, Exiv2::littleEndian, data);
  return {blob.begin(), blob.end()};
}

inline FileBytes ExifOf(const ExifCamera& camera) {
  const auto thousandths = [](double number) {
    return Exiv2::URational(static_cast<uint32_t>(std::lround(number * 1000)), 1000);
  };
  Exiv2::ExifData data;
  data["Exif.Image.Software"] = "a test";
  if (!camera.make.empty()) data["Exif.Image.Make"] = camera.make;
  if (!camera.model.empty()) data["Exif.Image.Model"] = camera.model;
  if (!camera.lens.empty()) data["Exif.Photo.LensModel"] = camera.lens;
  if (camera.focal_mm > 0) data["Exif.Photo.FocalLength"] = thousandths(camera.focal_mm);
  if (camera.digital_zoom > 0)
    data["Exif.Photo.DigitalZoomRatio"] = thousandths(camera.digital_zoom);
  if (camera.taken_width_px > 0) {
    data["Exif.Photo.PixelXDimension"] = camera.taken_width_px;
    data["Exif.Photo.PixelYDimension"] = camera.taken_height_px;
  }
  if (camera.focal_35mm > 0)
    data["Exif.Photo.FocalLengthIn35mmFilm"] = static_cast<uint16_t>(camera.focal_35mm);
  return BlockOf(data);
}

}  // namespace veduta::testing
