// SPDX-License-Identifier: Apache-2.0
#pragma once
// The report of a calibration: one HTML file that needs nothing else.

#include <string>

#include "engine/camera/calibration/calibrator.h"

namespace veduta {

// The advice, the parameters with their standard deviations, and the figures. `from` says in words
// what was calibrated from.
std::string CalibrationReport(const Calibration& calibration, const std::string& from);

}  // namespace veduta
