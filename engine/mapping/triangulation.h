// SPDX-License-Identifier: Apache-2.0
#pragma once
// A 3D point from two or more views of it (Hartley and Sturm 1997; refined by reprojection error).

#include <optional>
#include <span>
#include <vector>

#include "storage/base/transform.h"
#include "storage/model/pinhole.h"

namespace veduta {

struct Sighting {
  Rigid3 cam_from_world;
  Pinhole camera;
  Eigen::Vector2d x_px;  // where the point is seen
};

// Least-squares point, refined by Gauss-Newton on reprojection errors with unit weights. Nothing
// when the rays are parallel or the point comes to lie behind a camera. O(views). Thread-safe.
std::optional<Eigen::Vector3d> Triangulate(std::span<const Sighting> views);

// Largest angle between two rays to the point, degrees.
double TriangulationAngleDeg(std::span<const Sighting> views, const Eigen::Vector3d& point);
double RayAngleDeg(const Eigen::Vector3d& center_a, const Eigen::Vector3d& center_b,
                   const Eigen::Vector3d& point);

// Pixel error of one view; infinite behind the camera.
double ReprojectionErrorPx(const Sighting& view, const Eigen::Vector3d& point);

}  // namespace veduta
