// SPDX-License-Identifier: Apache-2.0
#pragma once
// Planes of gray values that own their memory, for the tests of this folder.

#include <vector>

#include "engine/features/sift_kernels.h"
#include "tests/engine/features/blob_scene.h"

namespace veduta {

// Readable kRowPad values beyond each row, as the kernels ask.
class OwnedPlane final {
 public:
  OwnedPlane(int width, int height)
      : width_(width),
        height_(height),
        stride_(width + 2 * kRowPad),
        values_(static_cast<size_t>(stride_) * static_cast<size_t>(height + 2)) {}
  explicit OwnedPlane(const GrayImage& image) : OwnedPlane(image.width, image.height) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        at(x, y) = static_cast<int16_t>((image.pixels[y * width_ + x] - 128) * kGrayUnit);
      }
    }
  }

  int16_t& at(int x, int y) { return values_[(y + 1) * stride_ + kRowPad + x]; }
  int16_t at(int x, int y) const { return values_[(y + 1) * stride_ + kRowPad + x]; }
  int width() const { return width_; }
  int height() const { return height_; }
  ptrdiff_t stride() const { return stride_; }
  int16_t* row(int y) { return &at(0, y); }
  GrayPlane view() const { return {&values_[stride_ + kRowPad], stride_, width_, height_}; }

 private:
  int width_, height_;
  ptrdiff_t stride_;
  std::vector<int16_t> values_;
};

}  // namespace veduta
