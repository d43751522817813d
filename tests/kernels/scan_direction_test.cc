// SPDX-License-Identifier: Apache-2.0
// Goal: the lines of every direction meet each pixel exactly once, and each starts on a border.
// Method: all lines are walked over images of every small size.
#include "kernels/scan_direction.h"

#include <gtest/gtest.h>

#include <iterator>
#include <vector>

#include "kernels/scanline.h"

namespace veduta {
namespace {

TEST(ScanDirection, LinesMeetEveryPixelOnce) {
  static_assert(std::size(kScanDirectionTable) == kScanDirections);
  for (const ScanDirection& direction : kScanDirectionTable) {
    for (int width = 1; width <= 6; ++width) {
      for (int height = 1; height <= 6; ++height) {
        const auto is_inside = [&](int x, int y) {
          return x >= 0 && y >= 0 && x < width && y < height;
        };
        std::vector<int> met(static_cast<size_t>(width * height), 0);
        for (uint32_t line = 0; line < direction.LineCount(width, height); ++line) {
          const ScanStart start = direction.Start(line, width, height);
          ASSERT_TRUE(is_inside(start.x, start.y));
          EXPECT_FALSE(is_inside(start.x - direction.dx, start.y - direction.dy))
              << "a line begins where nothing lies before it";
          for (int x = start.x, y = start.y; is_inside(x, y); x += direction.dx, y += direction.dy)
            ++met[static_cast<size_t>(y * width + x)];
        }
        EXPECT_EQ(met, std::vector<int>(met.size(), 1))
            << direction.dx << ", " << direction.dy << " over " << width << "x" << height;
      }
    }
  }
}

}  // namespace
}  // namespace veduta
