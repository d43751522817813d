// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/homography_decomposition.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace veduta {

std::array<PlaneMotion, 2> DecomposeHomography(const Eigen::Matrix3d& h) {
  const double sign = h.determinant() < 0 ? -1 : 1;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(h.transpose() * h);  // ascending
  const double middle = std::max(eigen.eigenvalues()[1], 1e-300);
  const Eigen::Matrix3d unit = h * (sign / std::sqrt(middle));
  const double large = std::max(eigen.eigenvalues()[2] / middle - 1, 0.0);  // sigma_1^2 - 1
  const double small = std::max(1 - eigen.eigenvalues()[0] / middle, 0.0);  // 1 - sigma_3^2
  const double both = std::max(large + small, 1e-300);
  const Eigen::Vector3d v2 = eigen.eigenvectors().col(1);

  std::array<PlaneMotion, 2> motions;
  for (int k = 0; k < 2; ++k) {
    // A vector of the plane's direction whose length H keeps, besides v2.
    const Eigen::Vector3d u =
        (std::sqrt(small / both) * eigen.eigenvectors().col(2) +
         (k == 0 ? 1 : -1) * std::sqrt(large / both) * eigen.eigenvectors().col(0))
            .normalized();
    Eigen::Matrix3d from, to;
    from << v2, u, v2.cross(u);
    const Eigen::Vector3d unit_v2 = unit * v2, unit_u = unit * u;
    to << unit_v2, unit_u, unit_v2.cross(unit_u);
    PlaneMotion& motion = motions[static_cast<size_t>(k)];
    motion.b_from_a = to * from.transpose();
    motion.normal_in_a =
        from.col(2).z() < 0 ? Eigen::Vector3d(-from.col(2)) : Eigen::Vector3d(from.col(2));
    motion.translation_per_distance = (unit - motion.b_from_a) * motion.normal_in_a;
  }
  return motions;
}

}  // namespace veduta
