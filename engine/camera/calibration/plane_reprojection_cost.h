// SPDX-License-Identifier: Apache-2.0
#pragma once
// The reprojection error with distortion, for Ceres' automatic derivatives.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace veduta {

// The lens of an adjustment: f, fy/fx, cx, cy, k1, k2, u0, v0; px and normalised coordinates as in
// CameraModel.
inline constexpr int kLensSize = 8;

// (projection - px) / sigma, over lens [8], rotation of cam_from_world [4, x y z w], its
// translation [3], point [3]. Steps that take a point behind the camera are refused.
struct PlaneReprojectionCost {
  Eigen::Vector2d px;
  double sigma_px;

  template <typename T>
  static bool Project(const T* lens, const T* rotation, const T* translation, const T* point,
                      T* projected) {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t(translation), x_world(point);
    const Eigen::Matrix<T, 3, 1> x = q * x_world + t;
    if (!(x[2] > T(1e-6))) return false;
    const T fx = lens[0], fy = lens[0] * lens[1];
    const T center_x = (lens[6] - lens[2]) / fx, center_y = (lens[7] - lens[3]) / fy;
    const T dx = x[0] / x[2] - center_x, dy = x[1] / x[2] - center_y;
    const T r2 = dx * dx + dy * dy;
    const T factor = T(1) + r2 * (lens[4] + lens[5] * r2);
    projected[0] = lens[6] + fx * dx * factor;
    projected[1] = lens[7] + fy * dy * factor;
    return true;
  }

  template <typename T>
  bool operator()(const T* lens, const T* rotation, const T* translation, const T* point,
                  T* residual) const {
    if (!Project(lens, rotation, translation, point, residual)) return false;
    residual[0] = (residual[0] - px[0]) / T(sigma_px);
    residual[1] = (residual[1] - px[1]) / T(sigma_px);
    return true;
  }
};

}  // namespace veduta
