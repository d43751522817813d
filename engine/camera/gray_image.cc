// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/gray_image.h"

#include <cstdint>

namespace veduta {

cv::Mat GrayFromBgr(const cv::Mat& bgr) {
  constexpr uint32_t kBlue = 1868, kGreen = 9617, kRed = 4899, kBits = 14;
  static_assert(kBlue + kGreen + kRed == 1 << kBits);
  cv::Mat gray(bgr.size(), CV_8UC1);
  for (int v = 0; v < bgr.rows; ++v) {
    const uint8_t* from = bgr.ptr(v);
    uint8_t* to = gray.ptr(v);
    for (int u = 0; u < bgr.cols; ++u, from += 3) {
      to[u] = static_cast<uint8_t>(
          (kBlue * from[0] + kGreen * from[1] + kRed * from[2] + (1u << (kBits - 1))) >> kBits);
    }
  }
  return gray;
}

}  // namespace veduta
