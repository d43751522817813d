// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a checkerboard of two by two fields looks like, with derivatives, as ceres::TinySolver wants
// it. Residuals are the model's grey level minus the image's. Jacobians are column-major,
// [residuals x parameters]; the pointer may be null.

#include <Eigen/Core>
#include <optional>
#include <span>

namespace veduta {

struct BoardSample {
  Eigen::Vector2d at;  // relative to the place where the corner is expected
  double gray;
};

// The model in the unit disc of an outline: level - gain s(x) s(y). (x, y) is relative to the
// corner, along axes at right angles, and s(d) = d / sqrt(d^2 + width^2) is a soft sign.
// Parameters: the corner (2), the angle of the x axis, gain, level.
class CoarseBoardCost final {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 5 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;

  explicit CoarseBoardCost(std::span<const BoardSample> samples) : samples_(samples) {}
  int NumResiduals() const { return static_cast<int>(samples_.size()); }
  bool operator()(const double* parameters, double* residuals, double* jacobian) const;

  double width = 0.1;  // of an edge, in radii of the outline; > 0

 private:
  std::span<const BoardSample> samples_;
};

// The model in the image, px: (level - gain s1 s2)(1 + slope . (x, y) / reach), with light that
// changes evenly. Line k goes through the corner c; the angle of its normal n is parameter
// kNormal + k. At p its distance is d = n . (p - c) - bend (t . (p - c) / reach)^2, where t points
// along the line, and s = erf(d / (sqrt(2) blur)). The residuals of the samples are followed by
// those of four weak priors: both bends are 0, both blurs are equal, and their mean is 1 px.
class BoardCost final {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 12 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;
  // Where in the parameters each begins. There are two of each but gain and level.
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

  // The covariance of the corner, px^2, from the residuals and their derivatives at the solution.
  // Nothing if the parameters are not all determined.
  std::optional<Eigen::Matrix2d> CenterCovariance(const Parameters& parameters) const;

 private:
  enum { kPriorCount = 4 };

  std::span<const BoardSample> samples_;
  double reach_px_;
};

}  // namespace veduta
