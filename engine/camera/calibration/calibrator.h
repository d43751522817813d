// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calibrates a camera from photos of points on a floor whose places are unknown (R3 to R5), finds
// gross errors, and says how well each parameter is known and what to photograph next.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/camera/calibration/observations.h"
#include "engine/camera/calibration/plane_adjustment.h"
#include "storage/base/status.h"
#include "storage/model/camera.h"

namespace veduta {

enum class CalibrationStatus : uint8_t {
  kGood,       // as good as the photos' noise lets it be; there may be notes
  kUncertain,  // a warning says what is not known well and what to photograph
};

enum class CalibrationAdvice : uint8_t {
  kPhotoQuality,    // a note of whoever looked at the photo itself: not sharp, of no use
  kPhotoLeftOut,    // a note: what the others say is not touched
  kPointsLeftOut,   // likewise
  kFewPhotos,       // a warning from here on
  kFocalLength,     // sigma of the focal length over 0.3 %: tilt more
  kPrincipalPoint,  // sigma over 1 % of the longer side
  kDistortion,      // sigma somewhere in the photo over 1/1000 of the longer side: photograph the
                    // corners
  kOneDistance,     // with one of the above, where the photos are all from one distance
  kResidual,        // the model does not explain the observations
  kManyLeftOut,     // so many observations contradict the rest that the rest may be wrong
};

struct CalibrationWarning {
  CalibrationAdvice kind;
  std::string text;  // a sentence or two: what is wrong, what to photograph next

  bool IsNote() const { return kind <= CalibrationAdvice::kPointsLeftOut; }
};

struct CalibrationPhoto {
  std::string name;
  std::string why_left_out;  // empty for a photo that was used
  uint32_t used_count = 0;   // observations
  uint32_t left_out_count = 0;
  double error_px_rms = 0;  // of those used: length of the residual
  double tilt_deg = 0;      // of the optical axis against the plane's normal
  double distance = 0;      // to the points' mean; 1 is the median photo's
};

struct CalibrationResidual {
  uint32_t photo = 0, id = 0;
  Eigen::Vector2d px;           // as observed
  Eigen::Vector2d residual_px;  // projected - observed
  bool is_used = false;
};

struct Calibration {
  CalibrationStatus status = CalibrationStatus::kUncertain;
  CameraModel model;
  Eigen::Matrix<double, 8, 8> covariance;  // of kIntrinsicNames, px
  std::vector<CalibrationWarning> warnings;
  std::vector<CalibrationPhoto> photos;  // in the order of the input
  std::vector<CalibrationResidual> residuals;
  double error_px_mean = 0, error_px_rms = 0;  // lengths of the residuals used
  double focal_search_px = 0;                  // what R4's search had said
  double distortion_sigma_px = 0;  // largest over the photo, of the displacement that is undone
  bool is_aspect_free = false;     // fy was found to differ from fx
  double aspect_sigmas = 0;        // how far fy / fx is from 1, in its standard deviation
  double height_rms = 0;  // of the points over their plane, over their RMS distance from its middle

  double Sigma(int intrinsic) const { return std::sqrt(covariance(intrinsic, intrinsic)); }
};

struct CalibrationOptions {
  double outlier_sigmas = 4.5;    // > 2: errors longer than this are gross
  uint32_t photo_points_min = 8;  // >= 4; a photo with fewer is left out
  double photo_share_min = 0.5;   // (0, 1]; of a photo's points that must fit
  PlaneAdjustmentOptions adjustment;

  Status Check() const;  // the first violated bound
};

// Photos of one size (a view of another one is an error that says so: two cameras, or one turned
// upright). Points that contradict the rest, and photos most of whose points do or whose focal
// length is another, are left out with a word.
//
// fy = fx unless the photos prove otherwise: the aspect is set free where that lowers the misfit by
// more than chance (4 sigma, and more than 1/1000); sensors have square pixels, and an aspect that
// the photos leave open would spoil f.
//
// kInvalidArgument, with what to photograph, if nothing can be told: too few photos or points in
// common, no tilt, photos of several cameras. Deterministic, one thread, about 1 s for 20 photos of
// 60 points. Thread-safe.
Result<Calibration> CalibrateCamera(const CalibrationInput& input,
                                    const CalibrationOptions& options = {});

}  // namespace veduta
