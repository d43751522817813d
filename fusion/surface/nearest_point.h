// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>

namespace veduta {

// The point of triangle abc nearest to p; also where the triangle is a segment or a point.
// Source: Ericson, Real-Time Collision Detection, section 5.1.5.
Eigen::Vector3d NearestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace veduta
