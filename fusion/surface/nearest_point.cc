// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/nearest_point.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace veduta {
namespace {

Eigen::Vector3d NearestOnSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                 const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double square = ab.squaredNorm();
  if (!(square > 0)) return a;
  return a + std::clamp(ab.dot(p - a) / square, 0.0, 1.0) * ab;
}

// For triangles without an area, where the regions below are not told apart.
Eigen::Vector3d NearestOnEdges(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                               const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  Eigen::Vector3d best = NearestOnSegment(p, a, b);
  for (const Eigen::Vector3d& other : {NearestOnSegment(p, b, c), NearestOnSegment(p, c, a)}) {
    if ((other - p).squaredNorm() < (best - p).squaredNorm()) best = other;
  }
  return best;
}

}  // namespace

Eigen::Vector3d NearestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  // |ab x ac|^2, by Lagrange's identity.
  const double lengths = ab.squaredNorm() * ac.squaredNorm(), slant = ab.dot(ac);
  if (!(lengths - slant * slant > 1e-12 * lengths)) return NearestOnEdges(p, a, b, c);
  const Eigen::Vector3d ap = p - a, bp = p - b, cp = p - c;
  const double a1 = ab.dot(ap), a2 = ac.dot(ap);
  if (a1 <= 0 && a2 <= 0) return a;
  const double b1 = ab.dot(bp), b2 = ac.dot(bp);
  if (b1 >= 0 && b2 <= b1) return b;
  const double w =
      a1 * b2 - b1 * a2;  // weights of c, b and a in the foot of the perpendicular, up to a factor
  if (w <= 0 && a1 >= 0 && b1 <= 0) return a + a1 / (a1 - b1) * ab;
  const double c1 = ab.dot(cp), c2 = ac.dot(cp);
  if (c2 >= 0 && c1 <= c2) return c;
  const double v = c1 * a2 - a1 * c2;
  if (v <= 0 && a2 >= 0 && c2 <= 0) return a + a2 / (a2 - c2) * ac;
  const double u = b1 * c2 - c1 * b2;
  if (u <= 0 && b2 >= b1 && c1 >= c2) return b + (b2 - b1) / ((b2 - b1) + (c1 - c2)) * (c - b);
  return a + (v * ab + w * ac) / (u + v + w);
}

}  // namespace veduta
