// SPDX-License-Identifier: Apache-2.0
#pragma once
// The undistorted ray of every pixel of a camera.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/camera.h"

namespace veduta::street {

// kInvalidArgument if a size, focal length or centre is out of range.
Status CheckCamera(const CameraModel& camera);

// The pixel at which a point of the camera frame (z > 0) appears: the forward model, equation in
// storage/model/camera.h.
Eigen::Vector2d ProjectPoint(const CameraModel& camera, const Eigen::Vector3d& point_in_cam);

struct RayTable {
  CameraModel camera;
  // x / z and y / z of each pixel's ray, [(height + 2) x (width + 2)]: one pixel more on every
  // side, so that differences exist at the border.
  std::vector<float> x, y;

  uint32_t stride() const { return camera.width_px + 2; }
};

// Inverts the distortion once a pixel by Newton's method, to rounding. Deterministic.
// kInvalidArgument if the distortion folds over within the picture, so that a pixel has no ray.
Result<RayTable> MakeRayTable(const CameraModel& camera);

}  // namespace veduta::street
