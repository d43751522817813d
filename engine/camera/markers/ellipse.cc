// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/ellipse.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

namespace veduta {
namespace {

using Conic = Eigen::Matrix<double, 6, 1>;  // a x^2 + b x y + c y^2 + d x + e y + f

std::optional<Ellipse> EllipseFromConic(const Conic& q) {
  Eigen::Matrix2d quadric;
  quadric << q[0], q[1] / 2, q[1] / 2, q[2];
  const double determinant = quadric.determinant();
  // A hyperbola, or a parabola up to rounding.
  if (!(determinant > 1e-12 * quadric.squaredNorm())) return std::nullopt;
  const Eigen::Vector2d linear(q[3], q[4]);
  const Eigen::Vector2d center = -0.5 * (quadric.inverse() * linear);
  const double value = q[5] + 0.5 * linear.dot(center);  // of the conic at the centre
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(quadric);
  const Eigen::Vector2d squares = -value * solver.eigenvalues().cwiseInverse();
  if (!(squares.minCoeff() > 0) || !squares.allFinite()) return std::nullopt;
  int major = squares[0] >= squares[1] ? 0 : 1;
  const Eigen::Vector2d axis = solver.eigenvectors().col(major);
  return Ellipse{center, std::sqrt(squares[major]), std::sqrt(squares[1 - major]),
                 std::atan2(axis.y(), axis.x())};
}

}  // namespace

Eigen::Matrix2d Ellipse::AxisMatrix() const {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Eigen::Matrix2d axes;
  axes << c * major, -s * minor, s * major, c * minor;
  return axes;
}

std::optional<Ellipse> FitEllipse(std::span<const Eigen::Vector2d> points) {
  if (points.size() < 5) return std::nullopt;
  const double n = static_cast<double>(points.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p / n;
  double spread = 0;
  for (const Eigen::Vector2d& p : points) spread += (p - mean).squaredNorm() / n;
  if (!(spread > 0)) return std::nullopt;
  const double scale = 1 / std::sqrt(spread);
  // M collects the squared values, N the squared gradients; the best conic minimises q'Mq / q'Nq.
  Eigen::Matrix<double, 6, 6> m = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 5, 5> gradients = Eigen::Matrix<double, 5, 5>::Zero();
  for (const Eigen::Vector2d& p : points) {
    const double x = scale * (p.x() - mean.x()), y = scale * (p.y() - mean.y());
    Conic row;
    row << x * x, x * y, y * y, x, y, 1;
    m.noalias() += row * row.transpose();
    Eigen::Matrix<double, 5, 1> by_x, by_y;
    by_x << 2 * x, y, 0, 1, 0;
    by_y << 0, x, 2 * y, 0, 1;
    gradients.noalias() += by_x * by_x.transpose() + by_y * by_y.transpose();
  }
  // f does not enter the gradients. With it eliminated the problem of the other five is regular.
  const Eigen::Matrix<double, 5, 1> column = m.topRightCorner<5, 1>();
  const Eigen::Matrix<double, 5, 5> reduced =
      m.topLeftCorner<5, 5>() - column * column.transpose() / m(5, 5);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix<double, 5, 5>> solver(reduced,
                                                                                     gradients);
  if (solver.info() != Eigen::Success) return std::nullopt;
  Conic q;
  q.head<5>() = solver.eigenvectors().col(0);
  q[5] = -column.dot(q.head<5>()) / m(5, 5);
  std::optional<Ellipse> ellipse = EllipseFromConic(q);
  if (!ellipse) return std::nullopt;
  ellipse->center = ellipse->center / scale + mean;
  ellipse->major /= scale;
  ellipse->minor /= scale;
  return ellipse;
}

double OutlineDistance(const Ellipse& ellipse, const Eigen::Vector2d& point) {
  const Eigen::Matrix2d unit_from_image = ellipse.AxisMatrix().inverse();
  const Eigen::Vector2d unit = unit_from_image * (point - ellipse.center);
  const double r = unit.norm();
  if (r == 0) return -ellipse.minor;
  const Eigen::Vector2d gradient = unit_from_image.transpose() * (unit / r);
  return (r - 1) / gradient.norm();
}

Eigen::Matrix3d HomographyFromCircle(const Ellipse& ellipse, const Eigen::Vector2d& center_image) {
  const Eigen::Matrix2d axes = ellipse.AxisMatrix();
  Eigen::Vector2d v = axes.inverse() * (center_image - ellipse.center);
  // Towards 1 the marker would be seen from within its own plane. 0.9 is chosen by hand.
  constexpr double kSlantMax = 0.9;
  if (v.norm() > kSlantMax) v *= kSlantMax / v.norm();
  const double gamma = 1 / std::sqrt(1 - v.squaredNorm());
  Eigen::Matrix3d boost;
  boost.topLeftCorner<2, 2>() =
      Eigen::Matrix2d::Identity() + (gamma * gamma / (gamma + 1)) * v * v.transpose();
  boost.topRightCorner<2, 1>() = gamma * v;
  boost.bottomLeftCorner<1, 2>() = gamma * v.transpose();
  boost(2, 2) = gamma;
  Eigen::Matrix3d image_from_unit = Eigen::Matrix3d::Identity();
  image_from_unit.topLeftCorner<2, 2>() = axes;
  image_from_unit.topRightCorner<2, 1>() = ellipse.center;
  return image_from_unit * boost;
}

}  // namespace veduta
