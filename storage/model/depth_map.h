// SPDX-License-Identifier: Apache-2.0
#pragma once
// Depth seen from one view.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace veduta {

struct DepthMap {
  uint32_t width_px = 0, height_px = 0;
  std::vector<float>
      depth;  // [height x width], row-major: z in the camera frame, world units; 0: not known
  std::vector<uint8_t> confidence;  // [height x width], 0 to 255; 0 where depth is not known

  float at(uint32_t x, uint32_t y) const { return depth[static_cast<size_t>(y) * width_px + x]; }
};

}  // namespace veduta
