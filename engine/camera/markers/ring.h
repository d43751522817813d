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
  // From the x axis that the board told to the marker's: 0 or half a turn.
  double turn_rad = 0;
  int error_count = 0;  // sectors that were read as the opposite of what they are
  // Sectors that could not be read: covered, outside of the image, or blurred to grey.
  int erasure_count = 0;
};

// Reads the ring between the dark ring and the checkerboard. Each sector is compared with the dark
// ring and with the paper around the marker, both at the sector's angle: so neither light nor
// shadow matters, and what covers a sector covers one of these too.
//
// gray             CV_8UC1.
// image_from_unit  from the marker's frame to the image, as the board tells it: up to half a turn.
//                  The code must begin at one of the axis' two ends, so a word that is read by
//                  chance must also be turned rightly.
// budget           the most that twice the errors and the erasures may be together, at most 6
//                  (kMarkerDistanceMin - 1). More than one error is never allowed.
//
// Nothing if no word of the code is near enough. Thread-safe. About 10 us.
std::optional<RingReading> ReadRing(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                    int budget);

}  // namespace veduta
