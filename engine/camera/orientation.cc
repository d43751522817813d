// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/orientation.h"

#include <utility>

namespace veduta {

ImageSize UprightSize(ImageSize stored, int orientation) {
  if (orientation >= 5) std::swap(stored.width_px, stored.height_px);
  return stored;
}

bool KeepsSides(int orientation) {
  return orientation >= 2 && orientation <= 4;
}

cv::Point2d StoredPoint(cv::Point2d upright_px, ImageSize stored, int orientation) {
  const auto [u, v] = std::pair(upright_px.x, upright_px.y);
  const double right = stored.width_px - 1.0, bottom = stored.height_px - 1.0;
  switch (orientation) {
    case 2:
      return {right - u, v};
    case 3:
      return {right - u, bottom - v};
    case 4:
      return {u, bottom - v};
    case 5:
      return {v, u};
    case 6:
      return {v, bottom - u};
    case 7:
      return {right - v, bottom - u};
    case 8:
      return {right - v, u};
    default:
      return upright_px;
  }
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
