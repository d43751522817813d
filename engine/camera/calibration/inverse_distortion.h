// SPDX-License-Identifier: Apache-2.0
#pragma once
// The paper's inverse distortion (equation 2): from the photo to where a pinhole camera would have
// seen the point.

#include <Eigen/Core>

namespace veduta {

// x_undistorted = c + (x - c)(1 + k1 r^2 + k2 r^4), r = |x - c|; all in ImageUnits. Equation 2
// leaves out the first c, which shifts all views by the same amount. With it the undistorted image
// stays where the photo was.
struct InverseDistortion {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double k1 = 0, k2 = 0;

  Eigen::Vector2d Undistort(const Eigen::Vector2d& x) const {
    const Eigen::Vector2d d = x - center;
    const double r2 = d.squaredNorm();
    return center + d * (1 + r2 * (k1 + k2 * r2));
  }
};

}  // namespace veduta
