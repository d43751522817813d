// SPDX-License-Identifier: Apache-2.0
#pragma once
// Ellipses in an image: the outlines of circular markers.

#include <Eigen/Core>
#include <optional>
#include <span>

namespace veduta {

struct Ellipse {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  // px
  double major = 0, minor = 0;                       // half axes, px; major >= minor > 0
  double angle_rad = 0;                              // of the major axis, from +x towards +y

  // Its columns are the half axes: image = center + AxisMatrix() * unit maps the unit disc onto the
  // inside of the ellipse.
  Eigen::Matrix2d AxisMatrix() const;
  Eigen::Vector2d At(const Eigen::Vector2d& unit) const { return center + AxisMatrix() * unit; }
};

// The ellipse that fits the points best by Taubin's approximation of the squared distance (G.
// Taubin, PAMI 1991), computed about the points' mean. Nothing for fewer than 5 points, or where
// the conic that fits best is no ellipse. O(N). Thread-safe.
std::optional<Ellipse> FitEllipse(std::span<const Eigen::Vector2d> points);

// The distance of a point from the ellipse, to first order, px: positive outside.
double OutlineDistance(const Ellipse& ellipse, const Eigen::Vector2d& point);

// The projective map, known up to a turn, from a circle's unit disc to the image. The circle's
// outline is seen as `ellipse`, and its centre at `center_image`, inside of it.
//
// A projective map keeps the unit circle in place if and only if it is a Lorentz transformation of
// (x, y, 1). Those that move the origin to a given place are boosts, up to a turn.
Eigen::Matrix3d HomographyFromCircle(const Ellipse& ellipse, const Eigen::Vector2d& center_image);

}  // namespace veduta
