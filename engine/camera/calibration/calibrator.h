// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calibrates a camera from photos of points on a floor whose places are unknown (R3 to R5), finds
// gross errors, and says how well each parameter is known and what to photograph next.

#include <cstdint>

#include "engine/camera/calibration/calibration_result.h"
#include "engine/camera/calibration/observations.h"
#include "engine/camera/calibration/plane_adjustment.h"
#include "storage/base/status.h"

namespace veduta {

struct CalibrationOptions {
  // Standard deviations; > 2. An observation with a longer error is a gross one and left out.
  // Errors of normal noise are longer than 4.5 in 1 of 25,000 cases (Rayleigh's distribution).
  double outlier_sigmas = 4.5;
  // >= 4; a photo with fewer points that fit is left out. Twice what a homography needs.
  uint32_t photo_points_min = 8;
  // (0, 1]; the share of a photo's points that must fit. Half: the majority decides.
  double photo_share_min = 0.5;
  PlaneAdjustmentOptions adjustment;

  Status Check() const;  // the first violated bound
};

// All photos must have one size; a photo of another size is an error that says whether it looks
// like another camera or like this one turned upright. Points that contradict the rest are left out
// with a note, and so are photos most of whose points do, and photos with a focal length of their
// own.
//
// fy = fx unless the photos prove otherwise, by 4 standard deviations and by more than 1/1000.
// Sensors have square pixels, and an aspect that the photos leave open would spoil f.
//
// kInvalidArgument, with what to photograph, if nothing can be told: too few photos or points in
// common, no tilt, photos of several cameras. Deterministic, one thread, about 1 s for 20 photos of
// 60 points. Thread-safe.
Result<Calibration> CalibrateCamera(const CalibrationInput& input,
                                    const CalibrationOptions& options = {});

}  // namespace veduta
