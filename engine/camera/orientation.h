// SPDX-License-Identifier: Apache-2.0
#pragma once
// EXIF's orientation: how the stored pixels must be turned for the photo to stand upright
// (EXIF 2.32, tag 274).

#include <opencv2/core.hpp>

#include "storage/model/image_size.h"

namespace veduta {

// The size after Upright; orientations 5 to 8 swap the sides. `orientation` in [1, 8].
ImageSize UprightSize(ImageSize stored, int orientation);

// The stored image turned upright. For orientation 1 the result shares the pixels of `stored`.
cv::Mat Upright(const cv::Mat& stored, int orientation);

}  // namespace veduta
