// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a checkerboard of two by two looks like, with derivatives, as ceres::TinySolver wants it.
// Residuals are model minus image in grey levels; Jacobians are column-major, [residuals x
// parameters], and may be null.

#include <Eigen/Core>
#include <optional>
#include <span>

namespace veduta {

struct BoardSample {
  Eigen::Vector2d at;  // from the place that the corner was expected at
  double gray;
};

// In the unit disc: level - gain s(x) s(y), (x, y) from the corner along axes at right angles, s(d)
// = d / sqrt(d^2 + width^2). Parameters: corner (2), angle of the x axis, gain, level.
class CoarseBoardCost final {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 5 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;

  explicit CoarseBoardCost(std::span<const BoardSample> samples) : samples_(samples) {}
  int NumResiduals() const { return static_cast<int>(samples_.size()); }
  bool operator()(const double* parameters, double* residuals, double* jacobian) const;

  double width = 0.1;  // of an edge

 private:
  std::span<const BoardSample> samples_;
};

// In the image, px: (level - gain s1 s2)(1 + slope . (x, y) / reach): light that changes evenly.
// Line k goes through the corner c with its normal n at angle kNormal + k; at p its distance is d =
// n . (p - c) - bend (t . (p - c) / reach)^2, t along the line; and s = erf(d / (sqrt(2) blur)).
// After the samples come four weak priors: on bends (0), on the blurs (their ratio 1), and on their
// mean (1 px).
class BoardCost final {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 12 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;
  // Where in the parameters each begins; two of each but gain and level.
  enum Index {
    kCorner = 0,
    kNormal = 2,
    kBend = 4,
    kLogBlur = 6,
    kSlope = 8,
    kGain = 10,
    kLevel = 11
  };

  BoardCost(std::span<const BoardSample> samples, double reach_px)
      : samples_(samples), reach_px_(reach_px) {}
  int NumResiduals() const { return static_cast<int>(samples_.size()) + kPriorCount; }
  bool operator()(const double* parameters, double* residuals, double* jacobian) const;

  // Of the corner, px^2, by the spread of the residuals and their derivatives at the solution.
  // Nothing if singular.
  std::optional<Eigen::Matrix2d> CenterCovariance(const Parameters& parameters) const;

 private:
  enum { kPriorCount = 4 };

  std::span<const BoardSample> samples_;
  double reach_px_;
};

}  // namespace veduta
