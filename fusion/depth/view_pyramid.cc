// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/view_pyramid.h"

namespace veduta {

View HalveView(const View& view) {
  View half;
  half.image = view.image;
  ViewGeometry& g = half.geometry;
  g = view.geometry;
  g.width_px /= 2;
  g.height_px /= 2;
  // Pixel x of the half lies between pixels 2x and 2x + 1 of the whole.
  g.camera.fx /= 2;
  g.camera.fy /= 2;
  g.camera.cx = (g.camera.cx - 0.5) / 2;
  g.camera.cy = (g.camera.cy - 0.5) / 2;
  half.gray.resize(static_cast<size_t>(g.width_px) * g.height_px);
  const size_t stride = view.geometry.width_px;
  for (size_t y = 0; y < g.height_px; ++y) {
    const uint8_t* top = view.gray.data() + 2 * y * stride;
    for (size_t x = 0; x < g.width_px; ++x) {
      const uint8_t* p = top + 2 * x;
      half.gray[y * g.width_px + x] =
          static_cast<uint8_t>((p[0] + p[1] + p[stride] + p[stride + 1] + 2) / 4);
    }
  }
  return half;
}

}  // namespace veduta
