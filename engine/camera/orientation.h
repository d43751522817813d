// SPDX-License-Identifier: Apache-2.0
#pragma once
// EXIF's orientation: how the stored pixels must be turned for the photo to stand upright
// (EXIF 2.32, tag 274), 1 to 8. Functions that say so also take 0, which is not noted, as 1.

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "storage/model/image_size.h"

namespace veduta {

// The size after Upright; orientations 5 to 8 swap the sides. `orientation` in [1, 8].
ImageSize UprightSize(ImageSize stored, int orientation);

// The orientation by which an upright image is turned to what is stored.
int InverseOrientation(int orientation);

// The stored image turned upright. For orientation 1 the result shares the pixels of `stored`.
cv::Mat Upright(const cv::Mat& stored, int orientation);

// Where a place of the upright photo lies in the stored pixels, both in px, with the centre of the
// top left pixel at 0, 0. `stored` is the size of the stored pixels. Takes 0.
Eigen::Vector2d StoredFromUpright(const Eigen::Vector2d& upright, ImageSize stored,
                                  int orientation);
// Its inverse.
Eigen::Vector2d UprightFromStored(const Eigen::Vector2d& place, ImageSize stored, int orientation);

// From the frame of a camera that has the stored pixels (x to their right, y down, z forward) to
// that of one which has them upright: a rotation about z. What is mirrored stays so. Takes 0.
Eigen::Matrix3d UprightCamFromStoredCam(int orientation);

}  // namespace veduta
