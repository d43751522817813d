// SPDX-License-Identifier: Apache-2.0
#pragma once
// The first image directory of a TIFF structure, which is also what an EXIF block is (TIFF 6.0,
// section 2; EXIF 2.32, section 4.5). Reads only the few tags that decide what to do with a photo,
// and never outside of the bytes given.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace veduta {

struct TiffTags {
  std::optional<uint32_t> width_px, height_px;  // tags 256 and 257
  std::optional<uint32_t> orientation;          // tag 274, as stored: 1 to 8 in sound files
};

// Nothing if the structure is broken: no header, or a directory that is not within the bytes. A tag
// of a wrong type or count is as good as absent; of equal tags the first counts.
std::optional<TiffTags> ReadTiffTags(std::span<const uint8_t> bytes);

// The tags of a TIFF that say something of the camera, the time and the place, as a block of EXIF
// of its own: those of its first directory and of the two that this leads to (34665 of EXIF, 34853
// of GPS), without values of more than 256 bytes. Empty where the structure is broken. 64 KiB at
// most.
std::vector<uint8_t> ExifOfTiff(std::span<const uint8_t> bytes);

}  // namespace veduta
