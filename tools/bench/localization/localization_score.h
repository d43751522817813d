// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far localised photos are from where they were taken, and whether they said so.

#include <optional>
#include <string>
#include <vector>

#include "tools/bench/localization/localization_run.h"
#include "tools/bench/orders/truth_folder.h"

namespace veduta::localization {

struct PoseError {
  double center_m = 0, rotation_deg = 0;  // in the unit of the truth
};

// One photo that was asked about.
struct PhotoScore {
  std::string name, verdict;          // verdict: the reason where it was not localised
  std::optional<PoseError> error;     // of the localised pose
  std::optional<PoseError> nearby;    // the same against the images that it rests on alone
  std::optional<PoseError> adjusted;  // of its pose after it was added as well
  // d' C^-1 d of the error by the stated covariance: of the centre (3 degrees of freedom), and of
  // rotation and centre (6); against the images that it rests on, since their poses are what the
  // covariance takes for given.
  std::optional<double> center_squares, pose_squares;
  // Of a camera that was estimated: its focal length over the right one, less 1, and that in the
  // standard deviations that were stated.
  std::optional<double> focal_error_share, focal_deviations;
  double ms = 0;  // of this photo, on its threads
};

// Errors are against the similarity that fits the other photos of the reconstruction, or those that
// the pose rests on, as they are at that time, to the truth: their centres, and for each a point
// ahead of it by a tenth of the
// extent, for centres along a line leave a turn around it open (Umeyama 1991). Nothing is scored
// against fewer than three others with truth.
std::vector<PhotoScore> ScoreLocalization(const LocalizationRun& run, const orders::Truth& truth);

// 95 % of the squares with 3 and with 6 degrees of freedom are below (chi-squared).
inline constexpr double kCenterSquares95 = 7.8147, kPoseSquares95 = 12.5916;

// The figures of many photos as lines of text.
std::string Summary(const std::vector<PhotoScore>& scores);
// One photo as a line of text.
std::string PhotoText(const PhotoScore& score);

}  // namespace veduta::localization
