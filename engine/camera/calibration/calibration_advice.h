// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a calibration's numbers mean for the person who holds the camera.

#include <Eigen/Core>
#include <vector>

#include "engine/camera/calibration/calibration_result.h"

namespace veduta {

// Notes on what was left out, and a warning for each parameter whose standard deviation is too
// large, with what to photograph next. Reads all of `calibration` but its warnings and its status.
std::vector<CalibrationWarning> Advise(const Calibration& calibration);

// The largest standard deviation, over a grid of the photo, of the displacement that the model
// takes off a pixel when it undistorts it; px.
double LargestDistortionSigma(const CameraModel& model,
                              const Eigen::Matrix<double, 8, 8>& covariance);

// The cells of a grid over the photo, row by row: whether a cell holds an observation that was
// used.
inline constexpr int kCoverageAcross = 8, kCoverageDown = 6;
std::vector<bool> CoveredCells(const Calibration& calibration);
// The share of the cells that hold one.
double CoveredShare(const Calibration& calibration);

}  // namespace veduta
