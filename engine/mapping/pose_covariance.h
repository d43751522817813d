// SPDX-License-Identifier: Apache-2.0
#pragma once
// How sure a pose is, from the normal equations of its image.

#include <optional>

#include "engine/mapping/bundle_problem.h"
#include "engine/mapping/camera_system.h"

namespace veduta {

struct PoseCovariance {
  // Of (omega, d), in this order: the true pose has the rotation exp([omega]x) R and the centre
  // c + d, where R and c are those of the problem's pose. omega is a rotation vector in the
  // camera's frame, radians; d lies along the world's axes, in its unit.
  Matrix6d covariance = Matrix6d::Zero();
  // The standard deviation of a feature's place, along each axis, that the covariance rests on.
  double error_px = 0;
};

// The covariance of pose 0 of a problem whose other poses are held, and whose points are
// marginalised: it holds the uncertainty of the points given where the other images are, and not
// that of the other images, so it says nothing of how a large reconstruction drifts.
//
// The problem is at its minimum under the options' Cauchy loss and weights (bundle_solver.h).
// Let psi = w e be the derivative of the loss at the error e, with w = 1 / (1 + |e|^2 / scale^2),
// and J the Jacobian by pose and points. The covariance is
//   K s^2 / m (sum of w^2 J' J)^-1,       s^2 = sum of |psi|^2 / (n - p),   m = mean of w^2,
//   K = 1 + p / n var(w^2) / m^2,         n numbers observed, p numbers estimated
// where all points weigh the same (Huber, Robust Statistics, 1981, equation 6.6 of chapter 7):
// w^2 is the second derivative of the loss, averaged over the directions of the error. Of the
// inverse it takes the pose's part, by the Schur complement S of each point. With points that
// weigh u, A^-1 B A^-1 takes the place of the inverse, with A = sum of u S and B = sum of u^2 S:
// a point counts for less, but no less exact. On synthetic scenes with noise of 0.3 to 0.7 px
// along each axis the true deviations are 0.94 to 1.16 times those told; of 1 px, 1.13 to 1.39
// times (tests/engine/mapping/pose_covariance_test.cc, with 3, 5 and 10 cameras).
//
// Nothing where the observations do not determine the pose, or leave no redundancy to estimate s
// from. O(observations). Deterministic.
std::optional<PoseCovariance> CovarianceOfPose(const BundleProblem& problem,
                                               const BundleOptions& options);

}  // namespace veduta
