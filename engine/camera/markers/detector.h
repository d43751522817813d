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
  // Grey levels; [1, 100]. Ink is at least this much darker than the mean of its surroundings.
  // Chosen by hand; not measured.
  int offset_gray = 6;
  // [0, 6]. Twice the wrong sectors (1 at most) and the unreadable ones together may be this many
  // of the ring's 23. The code allows 6; one is kept in reserve.
  int code_budget = 5;
  // [0.5, 1]; the share of the outline that must be seen. Chosen by hand; not measured.
  double support_min = 0.6;
  // [1, 178]; how many ids were printed. A marker with a higher id was misread and is dropped.
  uint32_t id_count = kMarkerIdCount;
  // px; > 0. A feature point whose standard deviation is larger is left out. Chosen by hand, far
  // above the 0.015 px that veduta-marker-bench finds for sharp markers.
  double sigma_px_max = 0.5;

  Status Check() const;  // the first violated bound, named with its value
};

// Pixels of the photo as it was taken: the centre of the top-left one is (0, 0).
struct MarkerDetection {
  MarkerId id = 0;
  // The feature point, which is the checkerboard's corner.
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  // Of center_px. Its scale comes from rendered photos of known truth.
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  Ellipse outline;        // of the dark ring. In a slanted view its centre is not the feature point
  double blur_px = 0;     // sigma of the checkerboard's edges
  int error_count = 0;    // sectors of the code that were corrected
  int erasure_count = 0;  // sectors of the code that could not be read

  // The mean standard deviation of the two coordinates.
  double SigmaPx() const;
};

struct MarkerSearch {
  std::vector<MarkerDetection> markers;  // ascending ids, each once
  // Ids seen at two places or more, ascending. They are not among the markers.
  std::vector<MarkerId> ambiguous;
  uint32_t outline_count = 0;  // ellipses that were looked at
};

// Finds markers that are about 20 px across or larger. Outlines are looked for in the photo and in
// copies of it that are halved again and again, down to a side of 40 px: noise and the size of a
// marker then do not matter. Where an outline and a checkerboard are found, the code is read, and
// the checkerboard is aligned in the photo's own pixels.
//
// `gray`: CV_8UC1 of any size, any content. Deterministic, one thread, thread-safe.
// kInvalidArgument on bad options or another type of image. On one core a photo of 3 Mpx takes
// 0.14 s and one of 12 Mpx 0.45 s (veduta-marker-bench; docs/calibration.md).
Result<MarkerSearch> DetectMarkers(const cv::Mat& gray, const MarkerOptions& options = {});

}  // namespace veduta
