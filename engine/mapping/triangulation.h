// SPDX-License-Identifier: Apache-2.0
#pragma once
// A 3D point from two or more views of it (Hartley and Sturm 1997; refined by reprojection error).

#include <limits>
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
// Whether TriangulationAngleDeg is `angle_deg_min` or more; fast where it is much more.
bool HasAngle(std::span<const Sighting> views, const Eigen::Vector3d& point, double angle_deg_min);
double RayAngleDeg(const Eigen::Vector3d& center_a, const Eigen::Vector3d& center_b,
                   const Eigen::Vector3d& point);

// Among places that a point is seen from, the first of those whose ray has the smallest angle with
// the ray from `center`, by RayAngleDeg. That takes an arc tangent, so it is asked only where the
// cosine does not tell already.
class NearestDirection {
 public:
  NearestDirection(const Eigen::Vector3d& center, const Eigen::Vector3d& point)
      : center_(center), point_(point), ray_((center - point).normalized()) {}

  // Whether this place is nearer than all that were asked about before.
  bool IsNearer(const Eigen::Vector3d& place) {
    const Eigen::Vector3d to_place = place - point_;
    const double cosine = ray_.dot(to_place) / to_place.norm();
    if (cosine < cosine_ - kCosineError) return false;
    const double angle_deg = RayAngleDeg(place, center_, point_);
    if (!(angle_deg < angle_deg_)) return false;
    angle_deg_ = angle_deg;
    cosine_ = cosine;
    return true;
  }

  double angle_deg() const { return angle_deg_; }  // infinite where there was no place

 private:
  // Cosines that differ by more belong to angles that differ: far above the rounding errors of
  // either, about 1e-15, since the cosine never falls by more than the angle rises.
  static constexpr double kCosineError = 1e-9;

  const Eigen::Vector3d center_, point_, ray_;
  double angle_deg_ = std::numeric_limits<double>::infinity();
  double cosine_ = -2;
};

// Pixel error of one view; infinite behind the camera.
double ReprojectionErrorPx(const Sighting& view, const Eigen::Vector3d& point);

}  // namespace veduta
