// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a camera has written into a photo about itself (EXIF 2.32, section 4.6).

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "storage/model/geo.h"
#include "storage/model/taken_time.h"

namespace veduta {

struct ExifCamera {
  // Printable ASCII without spaces around it, at most 64 characters; empty where nothing is told.
  std::string make, model, lens;
  // 0 where it is not told.
  double focal_mm = 0, digital_zoom = 0;
  // The focal length with which a photo of 36 x 24 mm shows as much; where it is not told, by the
  // sensor's resolution or its size (FindSensorSize), to some percent. 0 where nothing tells it.
  double focal_35mm = 0;
  // Of the photo as it was taken (PixelXDimension, PixelYDimension); 0 where not both are told.
  uint32_t taken_width_px = 0, taken_height_px = 0;

  bool operator==(const ExifCamera&) const = default;
};

// Reads a block of EXIF, which is a TIFF structure (PhotoHeader::exif); by exiv2. Whatever is
// broken in it is as good as absent. Thread-safe; one block at a time.
ExifCamera ReadExifCamera(std::span<const uint8_t> exif);

// Where the photo says that it was taken; nothing where it does not say, or says nonsense, or says
// that the receiver had lost its satellites, was off by more than 10 km, or counted on another
// datum than WGS 84 and its like (GPSMapDatum). Latitude and longitude of 0, both, are what
// receivers write that know nothing. Heights are as the camera has them, mostly above the sea. As
// above.
std::optional<GpsFix> ReadExifGps(std::span<const uint8_t> exif);

// Whether the photo says that it was taken there, to this program or to an earlier one, which took
// positions on any datum, and accuracies of more than 10 km for none. As above.
bool HoldsExifGps(std::span<const uint8_t> exif, const GpsFix& fix);

// When the photo says that it was taken (DateTimeOriginal, and OffsetTimeOriginal where it is told
// and makes sense); nothing where it does not say, or names a day that there is not. As above.
std::optional<TakenTime> ReadExifTaken(std::span<const uint8_t> exif);

// A block that says this and nothing else: what the functions above read of it are the same values,
// but that numbers are rounded to a millionth, angles to a ten-millionth of a second and the 35 mm
// equivalent to a millimetre.
// `orientation` in [1, 8]. Empty where exiv2 cannot write it. Thread-safe; one block at a time.
std::vector<uint8_t> WriteExif(const ExifCamera& camera, const std::optional<GpsFix>& gps,
                               const std::optional<TakenTime>& taken, int orientation);

}  // namespace veduta
