// SPDX-License-Identifier: Apache-2.0
#pragma once
// Colour to grey.

#include <opencv2/core.hpp>

namespace veduta {

// Y = (4899 R + 9617 G + 1868 B + 8192) >> 14, the luma of ITU-R BT.601 in whole numbers: the same
// bytes everywhere, and grey stays exactly as it was (the weights add up to 2^14). `bgr` is
// CV_8UC3; the result CV_8UC1 of its size.
cv::Mat GrayFromBgr(const cv::Mat& bgr);

}  // namespace veduta
