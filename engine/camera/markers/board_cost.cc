// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/board_cost.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace veduta {
namespace {

// Weights of the priors, in grey levels for each unit. Beside some hundred pixels with a noise of a
// few grey levels they matter only where the pixels say nothing. Chosen by hand; not measured.
constexpr double kBendWeight = 40;      // for each px of bend at the patch's edge
constexpr double kBlurRatioWeight = 4;  // for each unit of the logarithm of the blurs' ratio
constexpr double kBlurWeight = 2;       // for each unit of the logarithm of the mean blur

struct Line {
  Eigen::Vector2d normal, along;
  double bend, blur;
};

// The soft sign s of a line at one place, and its derivatives.
struct LineValue {
  double s, s_by_d, s_by_log_blur;
  Eigen::Vector2d d_by_corner;
  double d_by_angle, d_by_bend;
};

LineValue ValueAt(const Line& line, const Eigen::Vector2d& from_corner, double reach_px) {
  const double across = line.normal.dot(from_corner), length = line.along.dot(from_corner);
  const double scale = 1 / (reach_px * reach_px);
  const double d = across - line.bend * length * length * scale;
  LineValue value;
  value.s = std::erf(d / (std::numbers::sqrt2 * line.blur));
  value.s_by_d =
      std::sqrt(2 / std::numbers::pi) / line.blur * std::exp(-d * d / (2 * line.blur * line.blur));
  value.s_by_log_blur = -d * value.s_by_d;
  value.d_by_corner = -line.normal + 2 * line.bend * length * scale * line.along;
  value.d_by_angle = length + 2 * line.bend * length * across * scale;
  value.d_by_bend = -length * length * scale;
  return value;
}

Line MakeLine(const double* x, int k) {
  const double angle = x[BoardCost::kNormal + k];
  Line line;
  line.normal = {std::cos(angle), std::sin(angle)};
  line.along = {-std::sin(angle), std::cos(angle)};
  line.bend = x[BoardCost::kBend + k];
  // Bounded to [0.14, 55] px, so that no step of the solver ends in numbers that are not finite.
  line.blur = std::exp(std::clamp(x[BoardCost::kLogBlur + k], -2.0, 4.0));
  return line;
}

}  // namespace

bool CoarseBoardCost::operator()(const double* x, double* residuals, double* jacobian) const {
  const double c = std::cos(x[2]), s = std::sin(x[2]), gain = x[3];
  const size_t n = samples_.size();
  for (size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d from = samples_[i].at - Eigen::Vector2d(x[0], x[1]);
    const double dx = c * from.x() + s * from.y(), dy = c * from.y() - s * from.x();
    const double rx = std::sqrt(dx * dx + width * width), ry = std::sqrt(dy * dy + width * width);
    const double sx = dx / rx, sy = dy / ry;
    residuals[i] = x[4] - gain * sx * sy - samples_[i].gray;
    if (jacobian == nullptr) continue;
    const double by_dx = -gain * sy * width * width / (rx * rx * rx);
    const double by_dy = -gain * sx * width * width / (ry * ry * ry);
    jacobian[i] = -c * by_dx + s * by_dy;
    jacobian[n + i] = -s * by_dx - c * by_dy;
    jacobian[2 * n + i] = dy * by_dx - dx * by_dy;
    jacobian[3 * n + i] = -sx * sy;
    jacobian[4 * n + i] = 1;
  }
  return true;
}

bool BoardCost::operator()(const double* x, double* residuals, double* jacobian) const {
  const size_t n = samples_.size(), rows = n + kPriorCount;
  const Line lines[2] = {MakeLine(x, 0), MakeLine(x, 1)};
  const double gain = x[kGain];
  const auto at = [&](size_t row, int column) -> double& { return jacobian[column * rows + row]; };
  for (size_t i = 0; i < n; ++i) {
    const BoardSample& sample = samples_[i];
    const Eigen::Vector2d from = sample.at - Eigen::Vector2d(x[0], x[1]);
    const Eigen::Vector2d place = sample.at / reach_px_;
    const LineValue values[2] = {ValueAt(lines[0], from, reach_px_),
                                 ValueAt(lines[1], from, reach_px_)};
    const double product = values[0].s * values[1].s;
    const double light = 1 + x[kSlope] * place.x() + x[kSlope + 1] * place.y(),
                 gray = x[kLevel] - gain * product;
    residuals[i] = light * gray - sample.gray;
    if (jacobian == nullptr) continue;
    at(i, 0) = at(i, 1) = 0;
    for (int k = 0; k < 2; ++k) {
      const double by_s = -gain * light * values[1 - k].s, by_d = by_s * values[k].s_by_d;
      at(i, kCorner) += by_d * values[k].d_by_corner.x();
      at(i, kCorner + 1) += by_d * values[k].d_by_corner.y();
      at(i, kNormal + k) = by_d * values[k].d_by_angle;
      at(i, kBend + k) = by_d * values[k].d_by_bend;
      at(i, kLogBlur + k) = by_s * values[k].s_by_log_blur;
      at(i, kSlope + k) = gray * place[k];
    }
    at(i, kGain) = -light * product;
    at(i, kLevel) = light;
  }
  residuals[n] = kBendWeight * x[kBend];
  residuals[n + 1] = kBendWeight * x[kBend + 1];
  residuals[n + 2] = kBlurRatioWeight * (x[kLogBlur] - x[kLogBlur + 1]);
  residuals[n + 3] = kBlurWeight * (x[kLogBlur] + x[kLogBlur + 1]) / 2;
  if (jacobian == nullptr) return true;
  for (size_t row = n; row < rows; ++row) {
    for (int column = 0; column < NUM_PARAMETERS; ++column) at(row, column) = 0;
  }
  at(n, kBend) = at(n + 1, kBend + 1) = kBendWeight;
  at(n + 2, kLogBlur) = kBlurRatioWeight;
  at(n + 2, kLogBlur + 1) = -kBlurRatioWeight;
  at(n + 3, kLogBlur) = at(n + 3, kLogBlur + 1) = kBlurWeight / 2;
  return true;
}

std::optional<Eigen::Matrix2d> BoardCost::CenterCovariance(const Parameters& parameters) const {
  const int rows = NumResiduals();
  Eigen::VectorXd residuals(rows);
  Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS> jacobian(rows,
                                                                 static_cast<int>(NUM_PARAMETERS));
  (*this)(parameters.data(), residuals.data(), jacobian.data());
  const double freedom = std::max(1.0, static_cast<double>(rows - NUM_PARAMETERS));
  const double variance = residuals.squaredNorm() / freedom;
  const Eigen::LDLT<Eigen::Matrix<double, NUM_PARAMETERS, NUM_PARAMETERS>> solver(
      jacobian.transpose() * jacobian);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return std::nullopt;
  const Eigen::Matrix<double, NUM_PARAMETERS, 2> columns =
      solver.solve(Eigen::Matrix<double, NUM_PARAMETERS, 2>::Identity());
  const Eigen::Matrix2d covariance = variance * columns.topRows<2>();
  if (!covariance.allFinite() || !(covariance.determinant() > 0)) return std::nullopt;
  return Eigen::Matrix2d(0.5 * (covariance + covariance.transpose()));
}

}  // namespace veduta
