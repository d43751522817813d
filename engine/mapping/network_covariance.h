// SPDX-License-Identifier: Apache-2.0
#pragma once
// How sure a pose is among its neighbours, whose poses are uncertain as well.

#include <optional>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pose_covariance.h"
#include "engine/mapping/unknown_camera.h"
#include "storage/model/camera.h"

namespace veduta {

// The least-squares problem of a placed view and of the images that share most points with it,
// `neighbors_max` at most, in which nothing is held: the view is the first pose; the points are
// those that two of these images see, with what these images see of them. They must be loaded with
// their neighbourhood. Reads the map only.
BundleProblem NetworkProblem(const CityMap& map, ImageId view, uint32_t neighbors_max);

// The covariance of pose 0 of a problem in which all poses and points are free (a free network), in
// the frame that the other poses define; (omega, d) as in PoseCovariance. What moves all of it, a
// similarity, is no error: of all solutions the one is taken whose other poses have moved least, by
// the sum of |d|^2 / depth^2 + |omega|^2 with the median depth of the points in camera 0 (the
// S-transformation: Baarda, S-transformations and criterion matrices, 1973).
//
// Errors of features are not independent: those side by side, which see the same wall from the same
// place, share some. So the covariance is the cluster-robust one (Liang and Zeger, Longitudinal
// data analysis using generalized linear models, 1986)
//   H^- (sum over cells of g g') H^-,
// with H = sum of w^2 J' J and the derivatives g = sum of w J' e of a cell, a quarter of the
// picture's width on a side, after the points are eliminated; w as in CovarianceOfPose. Errors are
// smaller for what is estimated from them. A point that n numbers observe takes 3 of them, so its
// errors count n / (n - 3) times; the p numbers of the poses take some of what c cells tell, so the
// derivatives count 2 c / (2 c - p) times (the jackknife with the mean leverage: MacKinnon and
// White, Journal of Econometrics, 1985, HC3).
// `error_px` is that of independent errors.
//
// Nothing where fewer than two other poses are there, or the observations do not determine the
// network. O(observations * track length + poses^2 * (poses + cells)). Deterministic.
std::optional<PoseCovariance> CovarianceInNetwork(const BundleProblem& problem,
                                                  double loss_scale_px);

// The covariance of a pose whose lens was estimated with it.
struct CameraCovariance {
  PoseCovariance pose;
  Eigen::Matrix<double, kLensUnknowns, kLensUnknowns> lens;  // of a lens's unknowns
};

// CovarianceInNetwork where the lens of image 0 is unknown, too. Its pixels are square, and all but
// the focal length is drawn to 0 (LensDeviations). Observations of image 0 are undistorted by
// `lens`.
std::optional<CameraCovariance> CovarianceWithLens(const BundleProblem& problem,
                                                   const CameraModel& lens, double loss_scale_px);

}  // namespace veduta
