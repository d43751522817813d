// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a calibration tells (calibrator.h).

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "storage/model/camera.h"

namespace veduta {

enum class CalibrationStatus : uint8_t {
  kGood,       // as good as the photos' noise allows; there may be notes
  kUncertain,  // a warning says what is not known well, and what to photograph
};

enum class CalibrationAdvice : uint8_t {
  // Notes: they say nothing against the result.
  kPhotoQuality,   // what the photo itself shows: it is not sharp, it has too few markers
  kPhotoLeftOut,   // a photo was left out
  kPointsLeftOut,  // points were left out
  // Warnings.
  kFewPhotos,
  kFocalLength,     // sigma of the focal length over 0.3 %: tilt more
  kPrincipalPoint,  // sigma over 1 % of the longer side
  kDistortion,      // sigma over 1/1000 of the longer side: photograph the corners
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
  uint32_t used_count = 0;   // of its observations
  uint32_t left_out_count = 0;
  double error_px_rms = 0;  // RMS length of the residuals of those used
  double tilt_deg = 0;      // of the optical axis against the plane's normal
  double distance = 0;      // from the points' mean, over that of the median photo
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
  double focal_search_px = 0;                  // what the search for the focal length said (R4)
  double distortion_sigma_px = 0;              // LargestDistortionSigma
  bool is_aspect_free = false;                 // the photos prove that fy differs from fx
  double aspect_sigmas = 0;  // how far fy / fx is from 1, in its standard deviations
  double height_rms = 0;  // of the points over their plane, over their RMS distance from its middle

  uint32_t UsedPhotoCount() const;
  double Sigma(int intrinsic) const { return std::sqrt(covariance(intrinsic, intrinsic)); }
};

}  // namespace veduta
