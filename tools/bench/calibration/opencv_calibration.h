// SPDX-License-Identifier: Apache-2.0
#pragma once
// OpenCV's calibrateCamera on the same observations, to compare with. It is told where the points
// lie; we are not.

#include <Eigen/Core>
#include <vector>

#include "engine/camera/calibration/observations.h"

namespace veduta {

struct OpenCvCalibration {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::vector<double> distortion;  // k1 k2 p1 p2 k3
  double error_px_rms = 0;
};

enum class OpenCvTarget : uint8_t {
  kFlat,     // the points' z left out
  kHeights,  // first flat, then once more from there with z
  kFree,     // calibrateCameraRO: the points themselves are adjusted; all photos must show all of a
             // regular grid
};

// points: where each id lies. The model is OpenCV's usual one: fx, fy, cx, cy, k1, k2, p1, p2, k3.
// grid_columns: of kFree alone.
OpenCvCalibration CalibrateWithOpenCv(const CalibrationInput& input,
                                      const std::vector<Eigen::Vector3d>& points,
                                      OpenCvTarget target, int grid_columns = 0);

}  // namespace veduta
