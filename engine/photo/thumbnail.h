// SPDX-License-Identifier: Apache-2.0
#pragma once
// A small picture of a photo.

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

// A JPEG of the picture (CV_8UC3, blue first; not empty), whose longer side has `side_px` (>= 1) at
// most. Each pixel is the mean of those that it stands for; a picture that is smaller stays so.
// kIoError where the encoder fails.
Result<std::vector<uint8_t>> MakeThumbnail(const cv::Mat& bgr, uint32_t side_px);

}  // namespace veduta
