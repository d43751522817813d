// SPDX-License-Identifier: Apache-2.0
#pragma once
// How a key view's pixels move in its sensor views, and at which inverse depths to look for them.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "storage/model/view.h"

namespace veduta {

// A pixel (x, y) of the key view at inverse depth w (1 / z) is seen in the sensor view, in px, at
// the ray rotation (x, y, 1) + w translation.
struct SweepGeometry {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;

  SweepGeometry(const ViewGeometry& key, const ViewGeometry& sensor);
  Eigen::Vector3d Ray(double x_px, double y_px, double inverse_depth) const {
    return rotation * Eigen::Vector3d(x_px, y_px, 1) + inverse_depth * translation;
  }
};

// Inverse depths first + k * step, from far to near.
struct PlaneSpacing {
  double first = 0, step = 0;
  uint32_t count = 0;
};

// Px that a point moves in the fastest of the sensor views when its inverse depth grows by one,
// where it is seen in it: the 90th percentile over a grid of pixels and of inverse depths in
// [first, last]. 0 if no view sees any.
double PixelsPerInverseDepth(const ViewGeometry& key, std::span<const ViewGeometry> sensors,
                             double first, double last);

// Planes at most `step_px` apart where there may be as many, else `count_max` of them.
PlaneSpacing SpacePlanes(double first, double last, double pixels_per_inverse_depth, double step_px,
                         uint32_t count_max);

}  // namespace veduta
