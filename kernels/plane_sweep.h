// SPDX-License-Identifier: Apache-2.0
#pragma once
// What it costs to see a key view's pixel on a plane: census and gradient of the key view against
// the warped sensor views'.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/device.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

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

// The cost of every plane at every pixel. A sensor view is warped by bilinear interpolation in
// fixed point (8 bits of fraction). Its cost at a pixel is 2 c + min(g, 32), at most 100. c counts
// those of the 34 neighbors in a window of 7 x 5 that are darker than the center in one view and
// not in the other (census; Zabih and Woodfill 1994); g is the difference of the gradients, |dx| +
// |dy| by central differences. A change of brightness changes neither; a change of contrast does
// not change c. With one or two sensor views the better cost counts, with more the mean of the best
// two of those that see the point, so that a view whose sight is blocked does no harm. Outside of
// an image its edge is repeated.
//
// Computed on the device, or in C++ on the pool where the device is null, with the same bits.
// O(pixels * planes * sensors) time. Thread-safe. kInvalidArgument as Check says, kIoError from the
// device.
Result<CostVolume> SweepPlanes(const SweepProblem& problem, Device* device, ThreadPool& pool);

}  // namespace veduta
