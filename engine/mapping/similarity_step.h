// SPDX-License-Identifier: Apache-2.0
#pragma once
// One Gauss-Newton step of a similarity between two frames.

#include <Eigen/Core>
#include <functional>
#include <span>

#include "engine/mapping/cross_sighting.h"

namespace veduta {

// The normal equations at one similarity, over its seven degrees of freedom: a motion of frame b,
// as rotation (rad), translation, and the logarithm of the scale. Residuals are in px and lose half
// of their weight at `scale_px` (Cauchy).
class SimilarityStep final {
 public:
  using Vector7 = Eigen::Matrix<double, 7, 1>;
  using Matrix7 = Eigen::Matrix<double, 7, 7>;

  SimilarityStep(const Sim3& b_from_a, double scale_px)
      : b_from_a_(b_from_a), scale_px_(scale_px) {}

  // How a point of frame b moves with the similarity that carries it there.
  static Eigen::Matrix<double, 3, 7> MotionOf(const Eigen::Vector3d& x_b);
  // The similarity after a motion of frame b.
  static Sim3 Moved(const Sim3& b_from_a, const Vector7& by);
  // Steps until it moves no more, or 15 times. `add` adds what is known to the equations.
  static Sim3 Refine(const Sim3& start, double scale_px,
                     const std::function<void(SimilarityStep*)>& add);

  const Sim3& b_from_a() const { return b_from_a_; }
  const Matrix7& normal() const { return normal_; }

  // `in_b` are cameras of b that see points of a; `in_a` the reverse. O(N).
  void AddSightings(std::span<const CrossSighting> in_b, std::span<const CrossSighting> in_a);
  // One equation: a residual in px, and how it changes with the motion.
  void AddResidual(double residual_px, const Vector7& gradient);
  // That the motion `from_mean` has led here from the mean of a distribution.
  void AddPrior(const Matrix7& information, const Vector7& from_mean);

 private:
  void Add(const CrossSighting& seen, const Eigen::Vector3d& x_cam,
           const Eigen::Matrix<double, 3, 7>& motion);
  Vector7 Solve() const;

  const Sim3 b_from_a_;
  const double scale_px_;
  Matrix7 normal_ = Matrix7::Zero();
  Vector7 gradient_ = Vector7::Zero();
};

}  // namespace veduta
