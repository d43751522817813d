// SPDX-License-Identifier: Apache-2.0
#pragma once
// The lines that an image is scanned along.

#include <cstdint>

namespace veduta {

struct ScanStart {
  int x = 0, y = 0;
};

struct ScanDirection {
  int dx = 0, dy = 0;

  // Lines that together meet every pixel once.
  uint32_t LineCount(uint32_t width, uint32_t height) const {
    if (dy == 0) return height;
    return dx == 0 ? width : width + height - 1;
  }
  // The first pixel of a line, on the border that the direction points away from. Diagonals start
  // on the top or bottom row first, and then on the rest of one side.
  ScanStart Start(uint32_t line, uint32_t width, uint32_t height) const {
    const int w = static_cast<int>(width), h = static_cast<int>(height), i = static_cast<int>(line);
    const int side = dx > 0 ? 0 : w - 1, row = dy > 0 ? 0 : h - 1;
    if (dy == 0) return {side, i};
    if (dx == 0 || i < w) return {i, row};
    return {side, row + dy * (i - w + 1)};
  }
};

inline constexpr ScanDirection kScanDirectionTable[] = {{1, 0}, {-1, 0}, {0, 1},  {0, -1},
                                                        {1, 1}, {-1, 1}, {1, -1}, {-1, -1}};

}  // namespace veduta
