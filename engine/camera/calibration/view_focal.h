// SPDX-License-Identifier: Apache-2.0
#pragma once
// The focal length that one photo alone would have. It tells photos of another camera or of another
// zoom.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "engine/camera/calibration/plane_adjustment.h"

namespace veduta {

struct ViewFocal {
  double focal_px = 0;
  // The standard deviation, from the photo's own residuals. Large for a photo without tilt.
  double sigma_px = 0;
  // RMS of the residuals' coordinates at that focal length, over the observations' sigma.
  double error_sigmas = 0;
};

// Adjusts fx (and fy with it) and the pose of view `view` to its observations by Cauchy's loss, all
// else of the scene held. Observations of other views are passed over. sigma_px is infinite if
// nothing can be told.
ViewFocal EstimateViewFocal(const std::vector<PlaneObservation>& observations,
                            const PlaneScene& scene, uint32_t view);

}  // namespace veduta
