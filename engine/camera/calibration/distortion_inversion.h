// SPDX-License-Identifier: Apache-2.0
#pragma once
// From the paper's inverse distortion to CameraModel's forward distortion, by least squares: the
// inverse of such a polynomial is no such polynomial.

#include "engine/camera/calibration/inverse_distortion.h"
#include "engine/camera/calibration/planar_views.h"
#include "storage/model/camera.h"

namespace veduta {

// How far a model that was found is from the model that was asked for, over a grid of the image.
struct ConversionResidual {
  double mean_px = 0, largest_px = 0;
};
// Beyond this, somewhere in the photo, a person is warned of a conversion. Chosen by hand.
inline constexpr double kResidualGoodPx = 0.3;

// A CameraModel (forward distortion) with the focal length, principal point and size of `pinhole`
// that undistorts as `inverse` does: k1 and k2 minimise, over a grid of the photo, the squared
// distance between where the forward model takes the undistorted point and the photo's point.
// Linear in k1 and k2; the centre is kept. O(1000).
CameraModel InvertDistortion(const InverseDistortion& inverse, const ImageUnits& units,
                             const CameraModel& pinhole, ConversionResidual* residual);

}  // namespace veduta
