// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras as people hold them, in a world whose z is up.

#include <Eigen/Geometry>
#include <numbers>

#include "storage/base/transform.h"

namespace veduta::testing {

inline double Radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

// A camera at `center` that looks along `heading_deg`, clockwise from y (north), `pitch_deg` above
// the horizon, turned clockwise by `roll_deg` about its axis.
inline Rigid3 HeldCamera(const Eigen::Vector3d& center, double heading_deg, double pitch_deg = 0,
                         double roll_deg = 0) {
  const double heading = Radians(heading_deg), pitch = Radians(pitch_deg);
  const Eigen::Vector3d forward(std::sin(heading) * std::cos(pitch),
                                std::cos(heading) * std::cos(pitch), std::sin(pitch));
  const Eigen::Vector3d right(std::cos(heading), -std::sin(heading), 0);
  Eigen::Matrix3d world_from_cam;
  world_from_cam << right, forward.cross(right), forward;
  const Eigen::Quaterniond turned(
      world_from_cam *
      Eigen::AngleAxisd(Radians(roll_deg), Eigen::Vector3d::UnitZ()).toRotationMatrix());
  return Rigid3{turned, center}.Inverse();
}

}  // namespace veduta::testing
