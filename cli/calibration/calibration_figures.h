// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pictures of a calibration's report, each an SVG element.

#include <string>

#include "engine/camera/calibration/calibrator.h"

namespace veduta {

// Where in the photo points were seen, and the cells of a grid where none was.
std::string CoverageFigure(const Calibration& calibration);
// The residuals of the observations used, enlarged by *magnification.
std::string ResidualFigure(const Calibration& calibration, double* magnification);
// Where the lens moves points to, enlarged by *magnification, with both centres.
std::string DistortionFigure(const Calibration& calibration, double* magnification);
// A bar a photo: its RMS error; photos left out in grey.
std::string PhotoErrorFigure(const Calibration& calibration);

// For HTML and SVG: & < > " and control characters are replaced.
std::string Escaped(const std::string& text);
// With so many digits after the point.
std::string Fixed(double value, int digits);

}  // namespace veduta
