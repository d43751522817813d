// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is seen across two frames.

#include <Eigen/Core>

#include "storage/base/ids.h"
#include "storage/base/transform.h"

namespace veduta {

// A point of one frame, as a camera of another frame sees it.
struct CrossSighting {
  ImageId image;           // whose camera it is
  Rigid3 cam_from_world;   // of the camera, in its own frame
  Eigen::Vector2d x;       // normalised image coordinates
  Eigen::Vector3d point;   // in the other frame
  double focal_px = 1000;  // by which its error weighs
};

}  // namespace veduta
