// SPDX-License-Identifier: Apache-2.0
#pragma once
// The cross product as a matrix.

#include <Eigen/Core>

namespace veduta {

// The matrix whose product with w is v x w.
inline Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace veduta
