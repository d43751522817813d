// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a homography between two calibrated views tells of the motion and of the plane.

#include <Eigen/Core>
#include <array>

namespace veduta {

// H ~ R + t n^T: the plane is {X : n^T X = 1} times its distance, so n points away from camera a.
struct PlaneMotion {
  Eigen::Matrix3d b_from_a = Eigen::Matrix3d::Identity();  // R
  Eigen::Vector3d translation_per_distance =
      Eigen::Vector3d::Zero();  // t, over the distance of the plane from a
  Eigen::Vector3d normal_in_a = Eigen::Vector3d::UnitZ();  // unit
};

// The two motions, of the four that the algebra gives, whose plane lies before camera a where it
// looks. `h` (b from a) is in normalised image coordinates, its scale and sign are free. Where the
// views differ by a rotation alone the normal is open and comes out as any. [Ma, Soatto, Kosecka
// and Sastry 2004, section 5.3.3]
std::array<PlaneMotion, 2> DecomposeHomography(const Eigen::Matrix3d& h);

}  // namespace veduta
