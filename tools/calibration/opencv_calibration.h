// SPDX-License-Identifier: Apache-2.0
#pragma once
// OpenCV's calibrateCamera on the same observations, to compare with. It is told where the points lie; we are not.

#include <Eigen/Core>
#include <vector>

#include "engine/camera/calibration/observations.h"

namespace veduta {

struct OpenCvCalibration {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::vector<double> distortion;  // k1 k2 p1 p2 k3
  double error_px_rms = 0;
};

// points: where each id lies. First as a plane (their z left out), then, where `use_heights`, once more from there with
// z. The model is OpenCV's usual one: fx, fy, cx, cy, k1, k2, p1, p2, k3.
OpenCvCalibration CalibrateWithOpenCv(const CalibrationInput& input, const std::vector<Eigen::Vector3d>& points,
                                      bool use_heights);

}  // namespace veduta
