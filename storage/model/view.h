// SPDX-License-Identifier: Apache-2.0
#pragma once
// A photo as the dense pass sees it: without its lens, at the size that depth is computed at.

#include <cstdint>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/transform.h"
#include "storage/model/pinhole.h"

namespace veduta {

// Where an image was taken from and how it projects. Pixels: the center of the top-left pixel is
// (0, 0).
struct ViewGeometry {
  uint32_t width_px = 0, height_px = 0;
  Pinhole camera;  // of this size
  Rigid3 cam_from_world;
};

struct View {
  ImageId image;
  ViewGeometry geometry;
  std::vector<uint8_t> gray;  // [height x width], row-major; empty where nobody asked for it
  std::vector<uint8_t>
      rgb;  // [height x width x 3], row-major, sRGB; empty where nobody asked for it
  // [height x width], not 0 where the photo is filled and shows nothing; empty where it shows
  // something everywhere.
  std::vector<uint8_t> filled = {};
};

}  // namespace veduta
