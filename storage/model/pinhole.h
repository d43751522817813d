// SPDX-License-Identifier: Apache-2.0
#pragma once
// The camera of an undistorted photo: what is left of a CameraModel once the lens has been
// resampled away.

#include <Eigen/Core>

#include "storage/model/camera.h"
#include "storage/model/features.h"

namespace veduta {

struct Pinhole {
  double fx = 1, fy = 1, cx = 0, cy = 0;  // px

  Pinhole() = default;
  explicit Pinhole(const CameraModel& model)
      : fx(model.fx), fy(model.fy), cx(model.cx), cy(model.cy) {}

  double focal_px() const { return 0.5 * (fx + fy); }
  // Image coordinates at unit depth from px, and back.
  Eigen::Vector2d Normalize(const Eigen::Vector2d& x_px) const {
    return {(x_px.x() - cx) / fx, (x_px.y() - cy) / fy};
  }
  Eigen::Vector2d Normalize(const Keypoint& k) const {
    return {(k.x_px - cx) / fx, (k.y_px - cy) / fy};
  }
  Eigen::Vector2d Denormalize(const Eigen::Vector2d& x) const {
    return {fx * x.x() + cx, fy * x.y() + cy};
  }
  // Pixel of a point in the camera frame; z must be positive.
  Eigen::Vector2d Project(const Eigen::Vector3d& x_cam) const {
    return {fx * x_cam.x() / x_cam.z() + cx, fy * x_cam.y() / x_cam.z() + cy};
  }
};

}  // namespace veduta
