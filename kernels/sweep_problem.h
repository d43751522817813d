// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a plane sweep is given, and the costs that it gives.

#include <array>
#include <cstdint>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

// A gray image, row by row, in memory that the caller owns.
struct GrayView {
  uint32_t width_px = 0, height_px = 0;
  const uint8_t* pixels = nullptr;
};

// A sensor view and how the key view's pixels come to it: (x, y) at inverse depth w is seen where
// (u, v, 1) ~ rotation (x, y, 1) + w translation, in px; the rotation is row-major. The point is in
// front of the sensor view where the third row of the sum is positive.
struct SweepSensor {
  GrayView image;
  std::array<float, 9> rotation;
  std::array<float, 3> translation;
};

// The inverse depth of every plane in space is affine in the pixel: w = x * x_px + y * y_px +
// constant. Planes that follow each other in inverse depth by small steps stand next to each other;
// where one family of them ends and another begins, a gap keeps the two apart.
struct SweepPlane {
  float x = 0, y = 0, constant = 0;  // 1 / world unit

  static SweepPlane Gap();  // costs kCostMax everywhere
  bool is_gap() const { return constant != constant; }
};

// Pixel i sees plane k at the inverse depth base[i] + that of planes[k], or without a base at that
// of planes[k].
struct SweepProblem {
  GrayView key;
  std::vector<SweepSensor> sensors;  // 1 to 16
  std::vector<SweepPlane> planes;    // 2 to 1024
  std::vector<float> base;           // [height x width] of the key view, or empty

  Status Check() const;
};

inline constexpr uint32_t kSweepSensorsMax = 16;
inline constexpr uint32_t kSweepPlanesMax = 1024;
// Planes are padded to a multiple of this.
inline constexpr uint32_t kPlaneBlock = 16;
// A gap and padding cost kCostMax, the greatest cost that leaves room for penalties in a byte. A
// plane that no sensor view sees costs kUnseenCost, half of the worst cost of one that is seen.
inline constexpr uint8_t kCostMax = 127, kUnseenCost = 50;

struct CostVolume {
  uint32_t width_px = 0, height_px = 0, plane_count = 0, plane_stride = 0;
  std::vector<uint8_t> costs;  // [height x width x plane_stride]
};

inline uint32_t PlaneStride(uint32_t plane_count) {
  return (plane_count + kPlaneBlock - 1) / kPlaneBlock * kPlaneBlock;
}

}  // namespace veduta
