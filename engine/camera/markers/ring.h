// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reading a marker's code off the image.

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

#include "engine/camera/markers/marker_code.h"

namespace veduta {

struct RingReading {
  MarkerId id = 0;
  double turn_rad =
      0;  // the marker's x axis is this much further than the board said: 0 or half a turn
  int error_count = 0;  // sectors that said the opposite
  int erasure_count =
      0;  // sectors that said nothing: covered, outside of the image, or blurred to grey
};

// The ring between dark ring and checkerboard: each sector is dark or bright by the dark ring on
// its one side and the paper outside on the other, so neither light nor shadow matters, and
// whatever covers it covers one of these too.
//
// gray             CV_8UC1.
// image_from_unit  the marker's frame to the image, as the board tells it: up to half a turn. The
// code must begin at
//                  one of its two ends, so a word read by chance must also be turned rightly.
// budget           2 x errors + erasures that may be, at most 6 (kMarkerDistanceMin - 1); never
// more than one error. Thread-safe. About 10 us.
std::optional<RingReading> ReadRing(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                    int budget);

}  // namespace veduta
