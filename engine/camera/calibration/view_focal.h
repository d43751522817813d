// SPDX-License-Identifier: Apache-2.0
#pragma once
// The focal length that one photo alone would have: a photo of another camera, or of another zoom,
// stands out by it.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "engine/camera/calibration/plane_adjustment.h"

namespace veduta {

struct ViewFocal {
  double focal_px = 0;
  double sigma_px =
      0;  // standard deviation from the photo's own residuals; large for a photo without tilt
  double error_sigmas =
      0;  // RMS of the residuals' coordinates, over the observations' sigma, at that focal length
};

// Adjusts fx (and fy with it) and the pose of view `view` to its observations by Cauchy's loss, all
// else of the scene held. Observations of other views are passed over. sigma_px is infinite if
// nothing can be told.
ViewFocal EstimateViewFocal(const std::vector<PlaneObservation>& observations,
                            const PlaneScene& scene, uint32_t view);

}  // namespace veduta
