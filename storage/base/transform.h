// SPDX-License-Identifier: Apache-2.0
#pragma once
// Rigid and similarity transforms. `a_from_b` maps coordinates in frame b to frame a; compose as
// a_from_c = a_from_b * b_from_c.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace veduta {

struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
  Rigid3 Inverse() const {
    const Eigen::Quaterniond r = rotation.conjugate();
    return {r, -(r * translation)};
  }
  // Of a_from_b: the origin of frame b's parent; for cam_from_world the camera's centre in the
  // world.
  Eigen::Vector3d Center() const { return -(rotation.conjugate() * translation); }
};

inline Rigid3 operator*(const Rigid3& a_from_b, const Rigid3& b_from_c) {
  return {(a_from_b.rotation * b_from_c.rotation).normalized(), a_from_b * b_from_c.translation};
}

// x_a = scale * rotation * x_b + translation.
struct Sim3 {
  double scale = 1.0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const {
    return scale * (rotation * x) + translation;
  }
  Sim3 Inverse() const {
    const Eigen::Quaterniond r = rotation.conjugate();
    return {1.0 / scale, r, -(r * translation) / scale};
  }
};

inline Sim3 operator*(const Sim3& a_from_b, const Sim3& b_from_c) {
  return {a_from_b.scale * b_from_c.scale, (a_from_b.rotation * b_from_c.rotation).normalized(),
          a_from_b * b_from_c.translation};
}

// cam_from_new for a camera known in the old world: the camera frame takes the new world's scale.
inline Rigid3 TransformCameraWorld(const Sim3& new_from_old, const Rigid3& cam_from_old) {
  const Eigen::Quaterniond r =
      (cam_from_old.rotation * new_from_old.rotation.conjugate()).normalized();
  return {r, new_from_old.scale * cam_from_old.translation - r * new_from_old.translation};
}

}  // namespace veduta
