// SPDX-License-Identifier: Apache-2.0
#pragma once
// Areas of a photo that are not to be seen, such as faces. A photo that is stored with such areas
// is a JPEG in which they are filled, and which names them in its first segment: a comment that
// begins with kPrivateAreasMark, followed for each area by its x, y, width and height, u16 each,
// big-endian. So the areas go wherever the photo goes, and its hash covers them.

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "storage/model/image_size.h"

namespace veduta {

inline constexpr std::string_view kPrivateAreasMark("Veduta private areas 1", 23);  // with its zero
// As many as a segment has room for, and more than a detector finds in a photo; chosen by hand.
inline constexpr size_t kPrivateAreasMax = 4096;

// The pixels from (x, y) on, of a photo that stands upright.
struct PixelArea {
  uint16_t x = 0, y = 0, width = 0, height = 0;
  bool operator==(const PixelArea&) const = default;
};

// The areas that the photo names; none where it names none, or where what it has there is no list
// of areas that are not empty. Looks at the first segment alone. Thread-safe.
std::vector<PixelArea> ReadPrivateAreas(std::span<const uint8_t> photo);
// The segment, with its marker, for 1 to kPrivateAreasMax areas.
std::vector<uint8_t> PrivateAreasSegment(std::span<const PixelArea> areas);

// The part of an area that lies in a photo of this size; nothing where none does.
std::optional<PixelArea> ClipArea(const PixelArea& area, ImageSize size);
// Where an area of the upright photo lies in the photo as it is stored, turned by `orientation`
// (EXIF's, 1 to 8). The area lies within the photo.
PixelArea AreaAsStored(const PixelArea& area, ImageSize stored, int orientation);

}  // namespace veduta
