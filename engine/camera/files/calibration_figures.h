// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pictures of a calibration's report, each an SVG element.

#include <string>

#include "engine/camera/calibration/calibrator.h"

namespace veduta {

// Where in the photo points were seen, and the cells of a grid in which none was seen.
std::string CoverageFigure(const Calibration& calibration);
// The residuals of the observations that were used, drawn *magnification times as long.
std::string ResidualFigure(const Calibration& calibration, double* magnification);
// Where the lens moves points to, drawn *magnification times as far; the principal point and the
// centre of distortion.
std::string DistortionFigure(const Calibration& calibration, double* magnification);
// One bar for each photo, as long as its RMS error. Photos that were left out are grey.
std::string PhotoErrorFigure(const Calibration& calibration);

// A text as HTML and SVG hold it: & < > " are escaped, and control characters become spaces.
std::string Escaped(const std::string& text);
// A number with `digits` digits after the point; 0 for a number that is not finite.
std::string Fixed(double value, int digits);

}  // namespace veduta
