// SPDX-License-Identifier: Apache-2.0
#pragma once
// Markers in a photo (R2): outline, checkerboard, code, and the feature point to a fraction of a
// pixel.

#include <opencv2/core.hpp>
#include <vector>

#include "engine/camera/markers/ellipse.h"
#include "engine/camera/markers/marker_code.h"
#include "storage/base/status.h"

namespace veduta {

struct MarkerOptions {
  int offset_gray = 6;  // [1, 100]; ink is at least this much darker than its surroundings' mean
  int code_budget =
      5;  // [0, 6]; 2 x errors (1 at most) + erasures: up to 5 of 23 sectors may be covered
  double support_min = 0.6;  // [0.5, 1]; the part of the outline that must be seen
  uint32_t id_count =
      kMarkerIdCount;  // [1, kMarkerIdCount]; ids from here on are not on the sheets: misread
  double sigma_px_max = 0.5;  // > 0; feature points less certain than this are left out

  Status Check() const;  // the first violated bound, named with its value
};

// Pixels of the photo as it was taken: the centre of the top-left one is (0, 0).
struct MarkerDetection {
  MarkerId id = 0;
  Eigen::Vector2d center_px =
      Eigen::Vector2d::Zero();  // of the feature point, the checkerboard's corner
  Eigen::Matrix2d covariance_px2 =
      Eigen::Matrix2d::Zero();  // of center_px; calibrated on rendered photos
  Ellipse
      outline;  // of the dark ring; its centre is not the feature point where the view is slanted
  double blur_px = 0;     // sigma of the checkerboard's edges
  int error_count = 0;    // sectors of the code that were corrected
  int erasure_count = 0;  // sectors that could not be read

  // The mean standard deviation of the two coordinates.
  double SigmaPx() const;
};

struct MarkerSearch {
  std::vector<MarkerDetection> markers;  // ascending ids, each once
  std::vector<MarkerId>
      ambiguous;               // ids seen at two places or more, ascending: not among the markers
  uint32_t outline_count = 0;  // ellipses that were looked at
};

// Finds markers 10 px across and larger. Looks for outlines in the photo and in its halvings down
// to 40 px, so that neither large markers nor noise matter; reads the code where outline and
// checkerboard are found; aligns the checkerboard in the photo's own pixels.
//
// `gray`: CV_8UC1 of any size, any content. Deterministic, one thread, thread-safe.
// kInvalidArgument on bad options or another type of image. About 100 ms a core for 3 megapixels
// with 70 markers, 350 ms for 12.
Result<MarkerSearch> DetectMarkers(const cv::Mat& gray, const MarkerOptions& options = {});

}  // namespace veduta
