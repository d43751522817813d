// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a homography between two calibrated views tells of the motion and of the plane.

#include <Eigen/Core>
#include <array>

namespace veduta {

// H ~ R + t n^T. With the plane's distance from camera a as the unit, the plane is {X : n^T X = 1};
// so n points away from camera a.
struct PlaneMotion {
  Eigen::Matrix3d b_from_a = Eigen::Matrix3d::Identity();  // R
  Eigen::Vector3d translation_per_distance =
      Eigen::Vector3d::Zero();  // t, over the distance of the plane from a
  Eigen::Vector3d normal_in_a = Eigen::Vector3d::UnitZ();  // unit
};

// The algebra gives four motions; these are the two whose plane lies in front of camera a. `h` (b
// from a) is in normalized image coordinates; its scale and sign are free. Where the views differ
// by a rotation alone the normal is open, and any may be returned. [Ma, Soatto, Kosecka and Sastry
// 2004, section 5.3.3]
std::array<PlaneMotion, 2> DecomposeHomography(const Eigen::Matrix3d& h);

}  // namespace veduta
