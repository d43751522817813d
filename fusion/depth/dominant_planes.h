// SPDX-License-Identifier: Apache-2.0
#pragma once
// The few planes that much of a view lies on: the ground, facades. A plane's inverse depth is
// affine in the pixel.

#include <vector>

#include "fusion/depth/inverse_depth_map.h"

namespace veduta {

struct PlaneInView {
  double x = 0, y = 0, constant = 0;  // w = x * x_px + y * y_px + constant

  float At(uint32_t x_px, uint32_t y_px) const {
    return static_cast<float>(x * x_px + y * y_px + constant);
  }
};

// Up to `count_max` planes, those of most pixels first; each has at least a twentieth of the pixels
// within `difference_max` of it that no earlier plane has. By RANSAC on a grid of pixels, then
// least squares. Pixels whose confidence is 0 and those not known do not vote. Deterministic.
// O(grid), some ms.
std::vector<PlaneInView> FindDominantPlanes(const InverseDepthMap& map,
                                            const std::vector<uint8_t>& confidence,
                                            double difference_max, uint32_t count_max);

}  // namespace veduta
