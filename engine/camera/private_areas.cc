// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/private_areas.h"

#include <algorithm>
#include <array>

#include "storage/base/status.h"

namespace veduta {
namespace {

constexpr std::array<uint8_t, 4> kStart = {0xFF, 0xD8, 0xFF, 0xFE};  // of the JPEG, of a comment
constexpr size_t kLengthBytes = 2, kAreaBytes = 8;

uint16_t BigEndian16(std::span<const uint8_t> bytes, size_t at) {
  return static_cast<uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

}  // namespace

std::vector<PixelArea> ReadPrivateAreas(std::span<const uint8_t> photo) {
  const size_t before = kStart.size() + kLengthBytes + kPrivateAreasMark.size();
  if (photo.size() < before || !std::ranges::equal(photo.first(kStart.size()), kStart)) return {};
  const size_t length = BigEndian16(photo, kStart.size());  // with the two bytes of itself
  const size_t end = kStart.size() + length;
  if (end < before || end > photo.size() || (end - before) % kAreaBytes != 0) return {};
  const auto mark = photo.subspan(kStart.size() + kLengthBytes, kPrivateAreasMark.size());
  if (!std::equal(mark.begin(), mark.end(), kPrivateAreasMark.begin(),
                  [](uint8_t byte, char c) { return byte == static_cast<uint8_t>(c); }))
    return {};
  std::vector<PixelArea> areas;
  for (size_t at = before; at < end; at += kAreaBytes) {
    const PixelArea area{BigEndian16(photo, at), BigEndian16(photo, at + 2),
                         BigEndian16(photo, at + 4), BigEndian16(photo, at + 6)};
    if (area.width == 0 || area.height == 0) return {};
    areas.push_back(area);
  }
  return areas;
}

std::vector<uint8_t> PrivateAreasSegment(std::span<const PixelArea> areas) {
  VEDUTA_CHECK(!areas.empty() && areas.size() <= kPrivateAreasMax, "a segment of no such areas");
  std::vector<uint8_t> segment = {kStart[2], kStart[3]};
  const auto add = [&](size_t number) {
    segment.push_back(static_cast<uint8_t>(number >> 8));
    segment.push_back(static_cast<uint8_t>(number));
  };
  add(kLengthBytes + kPrivateAreasMark.size() + kAreaBytes * areas.size());
  for (const char c : kPrivateAreasMark) segment.push_back(static_cast<uint8_t>(c));
  for (const PixelArea& area : areas) {
    for (const uint16_t number : {area.x, area.y, area.width, area.height}) add(number);
  }
  return segment;
}

std::optional<PixelArea> ClipArea(const PixelArea& area, ImageSize size) {
  const uint32_t right = std::min<uint32_t>(area.x + area.width, size.width_px),
                 bottom = std::min<uint32_t>(area.y + area.height, size.height_px);
  if (right <= area.x || bottom <= area.y) return std::nullopt;
  return PixelArea{area.x, area.y, static_cast<uint16_t>(right - area.x),
                   static_cast<uint16_t>(bottom - area.y)};
}

PixelArea AreaAsStored(const PixelArea& area, ImageSize stored, int orientation) {
  PixelArea turned = area;
  if (orientation >= 5) {  // the sides are exchanged
    std::swap(turned.x, turned.y);
    std::swap(turned.width, turned.height);
  }
  const bool mirrors_x =
      orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool mirrors_y =
      orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  if (mirrors_x) turned.x = static_cast<uint16_t>(stored.width_px - turned.x - turned.width);
  if (mirrors_y) turned.y = static_cast<uint16_t>(stored.height_px - turned.y - turned.height);
  return turned;
}

}  // namespace veduta
