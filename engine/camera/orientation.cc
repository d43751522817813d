// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/orientation.h"

#include <utility>

namespace veduta {

ImageSize UprightSize(ImageSize stored, int orientation) {
  if (orientation >= 5) std::swap(stored.width_px, stored.height_px);
  return stored;
}

cv::Mat Upright(const cv::Mat& stored, int orientation) {
  constexpr int kUpsideDown = 0, kLeftRight = 1, kBoth = -1;  // cv::flip's codes
  cv::Mat upright;
  switch (orientation) {
    case 2:
      cv::flip(stored, upright, kLeftRight);
      return upright;
    case 3:
      cv::flip(stored, upright, kBoth);
      return upright;
    case 4:
      cv::flip(stored, upright, kUpsideDown);
      return upright;
    case 5:
      cv::transpose(stored, upright);
      return upright;
    case 6:
      cv::rotate(stored, upright, cv::ROTATE_90_CLOCKWISE);
      return upright;
    case 7:
      cv::transpose(stored, upright);
      cv::flip(upright, upright, kBoth);
      return upright;
    case 8:
      cv::rotate(stored, upright, cv::ROTATE_90_COUNTERCLOCKWISE);
      return upright;
    default:
      return stored;
  }
}

}  // namespace veduta
