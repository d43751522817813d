// SPDX-License-Identifier: Apache-2.0
#pragma once
// Width and height of an image, in px.

#include <cstdint>
#include <string>

namespace veduta {

struct ImageSize {
  uint32_t width_px = 0, height_px = 0;

  bool operator==(const ImageSize&) const = default;
  bool empty() const { return width_px == 0 || height_px == 0; }
  uint64_t pixel_count() const { return uint64_t{width_px} * height_px; }
  std::string Text() const { return std::to_string(width_px) + "x" + std::to_string(height_px); }
};

}  // namespace veduta
