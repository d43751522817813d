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

  // Columns: the half axes. image = center + AxisMatrix() * unit maps the unit disc onto the
  // inside.
  Eigen::Matrix2d AxisMatrix() const;
  Eigen::Vector2d At(const Eigen::Vector2d& unit) const { return center + AxisMatrix() * unit; }
};

// The ellipse that fits the points best by Taubin's approximation of the squared distance, computed
// about the points' mean (G. Taubin, PAMI 1991). Nothing for fewer than 5 points, or where another
// conic fits. O(N). Thread-safe.
std::optional<Ellipse> FitEllipse(std::span<const Eigen::Vector2d> points);

// Distance from the outline to first order, px: positive outside.
double OutlineDistance(const Ellipse& ellipse, const Eigen::Vector2d& point);

// The image of a circle about its centre, known up to a turn: the outline is `ellipse`, and the
// circle's centre is seen at `center_image`, inside. Maps the unit disc's places to the image's.
//
// A projective map keeps the unit circle in place exactly if it is a Lorentz transformation of (x,
// y, 1); those that move the origin to a given place are boosts (up to a turn).
Eigen::Matrix3d HomographyFromCircle(const Ellipse& ellipse, const Eigen::Vector2d& center_image);

}  // namespace veduta
