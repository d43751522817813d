// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a calibration's numbers mean for the person with the camera.

#include <Eigen/Core>
#include <vector>

#include "engine/camera/calibration/calibrator.h"

namespace veduta {

// Notes on what was left out, and a warning for everything that is known too badly, by its standard
// deviation, each with what to photograph next. Reads all of `calibration` but its warnings and
// status.
std::vector<CalibrationWarning> Advise(const Calibration& calibration);

// The largest standard deviation, over a grid of the photo, of the displacement that the model
// undoes; px.
double LargestDistortionSigma(const CameraModel& model,
                              const Eigen::Matrix<double, 8, 8>& covariance);

// Of a grid of cells over the photo, row by row: whether an observation used lies in it; and the
// share that has one.
inline constexpr int kCoverageAcross = 8, kCoverageDown = 6;
std::vector<bool> CoveredCells(const Calibration& calibration);
double CoveredShare(const Calibration& calibration);

}  // namespace veduta
