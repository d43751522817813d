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

Eigen::Vector2d StoredFromUpright(const Eigen::Vector2d& upright, ImageSize stored,
                                  int orientation) {
  Eigen::Vector2d place = upright;
  if (orientation >= 5) std::swap(place.x(), place.y());
  const bool is_from_right =
                 orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8,
             is_from_bottom =
                 orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  if (is_from_right) place.x() = stored.width_px - 1.0 - place.x();
  if (is_from_bottom) place.y() = stored.height_px - 1.0 - place.y();
  return place;
}

int InverseOrientation(int orientation) {
  // A quarter turn is undone by one the other way; all else is its own inverse.
  return orientation == 6 ? 8 : orientation == 8 ? 6 : orientation;
}

Eigen::Vector2d UprightFromStored(const Eigen::Vector2d& place, ImageSize stored, int orientation) {
  return StoredFromUpright(place, UprightSize(stored, orientation),
                           InverseOrientation(orientation));
}

Eigen::Matrix3d UprightCamFromStoredCam(int orientation) {
  // The stored pixels' axes in the upright photo: the columns.
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  switch (orientation) {
    case 3:
    case 4:
      turned.topLeftCorner<2, 2>() << -1, 0, 0, -1;
      break;
    case 5:
    case 6:
      turned.topLeftCorner<2, 2>() << 0, -1, 1, 0;
      break;
    case 7:
    case 8:
      turned.topLeftCorner<2, 2>() << 0, 1, -1, 0;
      break;
    default:
      break;
  }
  return turned;
}

}  // namespace veduta
