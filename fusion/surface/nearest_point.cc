// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/nearest_point.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace veduta {
namespace {

Eigen::Vector3d NearestOnSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double square = ab.squaredNorm();
  if (!(square > 0)) return a;
  return a + std::clamp(ab.dot(p - a) / square, 0.0, 1.0) * ab;
}

}  // namespace

Eigen::Vector3d NearestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double square = normal.squaredNorm();
  if (square > 0) {
    // Barycentric coordinates of the foot of the perpendicular; inside, that is the nearest point.
    const Eigen::Vector3d ap = p - a;
    const double v = ap.cross(ac).dot(normal) / square, w = ab.cross(ap).dot(normal) / square;
    if (v >= 0 && w >= 0 && v + w <= 1) return a + v * ab + w * ac;
  }
  Eigen::Vector3d best = NearestOnSegment(p, a, b);
  for (const Eigen::Vector3d& other : {NearestOnSegment(p, b, c), NearestOnSegment(p, c, a)}) {
    if ((other - p).squaredNorm() < (best - p).squaredNorm()) best = other;
  }
  return best;
}

}  // namespace veduta
