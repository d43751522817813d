// SPDX-License-Identifier: Apache-2.0
#pragma once
// Projection through a lens that is being refined.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "storage/model/camera.h"

namespace veduta {

// What is refined of a lens: the logarithm of how many times its focal length is what it was, and
// what is added to k1 and k2. Those go with the square and the fourth power of the focal length
// besides, so that the picture's distortion stays what it was where nothing is added.
inline constexpr int kLensValueCount = 3;
using LensChange = Eigen::Matrix<double, kLensValueCount, 1>;

// The pixel of the photo, as it was taken, that sees a point in the camera frame, z > 0. T is
// double, or a type that carries derivatives.
template <typename T>
Eigen::Matrix<T, 2, 1> ProjectThroughLens(const CameraModel& lens, const T* change,
                                          const Eigen::Matrix<T, 3, 1>& x_cam) {
  using std::exp;
  const T growth = exp(change[0]), growth2 = growth * growth;
  const T fx = lens.fx * growth, fy = lens.fy * growth;
  const T k1 = (lens.k1 + change[1]) * growth2, k2 = (lens.k2 + change[2]) * growth2 * growth2;
  // The center of distortion, and the ray seen from there, in normalized coordinates.
  const T center_x = (lens.u0 - lens.cx) / fx, center_y = (lens.v0 - lens.cy) / fy;
  const T x = x_cam.x() / x_cam.z() - center_x, y = x_cam.y() / x_cam.z() - center_y;
  const T r2 = x * x + y * y;
  const T stretch = 1.0 + r2 * (k1 + k2 * r2);
  return {fx * (center_x + x * stretch) + lens.cx, fy * (center_y + y * stretch) + lens.cy};
}

// The lens as it is with the change.
inline CameraModel ChangedLens(CameraModel lens, const LensChange& change) {
  const double growth = std::exp(change[0]), growth2 = growth * growth;
  lens.fx *= growth, lens.fy *= growth;
  lens.k1 = (lens.k1 + change[1]) * growth2;
  lens.k2 = (lens.k2 + change[2]) * growth2 * growth2;
  return lens;
}

// How far each value is drawn to 0 from, as by an observation of one pixel. Chosen by hand: what
// one photo tells of its focal length is off by 2 % and more, and what photos in a row tell is
// little at first; k1 and k2 that a few photos have told are off by hundredths.
inline constexpr double kLensPriorSigmas[kLensValueCount] = {0.03, 0.03, 0.03};

}  // namespace veduta
