// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/uncertain_similarity.h"

#include <Eigen/Dense>
#include <cmath>

#include "engine/mapping/similarity_step.h"
#include "engine/matching/two_view.h"
#include "storage/base/cross_matrix.h"

namespace veduta {
namespace {

using Vector7 = SimilarityStep::Vector7;
using Matrix7 = SimilarityStep::Matrix7;

// Errors at which what is seen loses weight, one after the other: a chain may be off by many pixels
// before what closes it is asked. Chosen by hand; not measured.
constexpr double kScalesPx[] = {64, 16, 4, 2};
// Of a central difference: of rotation (rad) and of the logarithm of the scale; translations are
// measured by the distance of the two cameras.
constexpr double kDifference = 1e-6;

// How a motion of frame b moves frame c: c_from_b exp(by) = exp(Adjoint * by) c_from_b.
Matrix7 Adjoint(const Sim3& c_from_b) {
  const Eigen::Matrix3d turn = c_from_b.rotation.toRotationMatrix();
  Matrix7 adjoint = Matrix7::Zero();
  adjoint.block<3, 3>(0, 0) = turn;
  adjoint.block<3, 3>(3, 0) = CrossMatrix(c_from_b.translation) * turn;
  adjoint.block<3, 3>(3, 3) = c_from_b.scale * turn;
  adjoint.block<3, 1>(3, 6) = -c_from_b.translation;
  adjoint(6, 6) = 1;
  return adjoint;
}

// The motion of frame b that leads from one similarity to another, where it is small.
Vector7 MotionBetween(const Sim3& from, const Sim3& to) {
  const Sim3 motion = to * from.Inverse();
  const Eigen::AngleAxisd turn(motion.rotation);
  Vector7 by;
  by << turn.angle() * turn.axis(), motion.translation, std::log(motion.scale);
  return by;
}

double LineErrorPx(const CrossMatch& match, const Sim3& b_from_a) {
  const Rigid3 cam_a_from_b = TransformCameraWorld(b_from_a, match.cam_a_from_a);
  const Rigid3 b_from_cam_a = cam_a_from_b.Inverse();
  return match.focal_px *
         SignedSampsonDistance(EssentialFromPose(match.cam_b_from_b * b_from_cam_a), match.x_a,
                               match.x_b);
}

void AddMatch(const CrossMatch& match, SimilarityStep* step) {
  const Rigid3 cam_a_from_b = TransformCameraWorld(step->b_from_a(), match.cam_a_from_a);
  const double baseline = (cam_a_from_b.Center() - match.cam_b_from_b.Center()).norm();
  if (!(baseline > 0)) return;
  Vector7 gradient;
  for (int i = 0; i < 7; ++i) {
    Vector7 by = Vector7::Zero();
    by[i] = i >= 3 && i < 6 ? kDifference * baseline : kDifference;
    const double after = LineErrorPx(match, SimilarityStep::Moved(step->b_from_a(), by)),
                 before = LineErrorPx(match, SimilarityStep::Moved(step->b_from_a(), -by));
    gradient[i] = (after - before) / (2 * by[i]);
  }
  step->AddResidual(LineErrorPx(match, step->b_from_a()), gradient);
}

}  // namespace

UncertainSimilarity Chain(const UncertainSimilarity& c_from_b,
                          const UncertainSimilarity& b_from_a) {
  const Matrix7 adjoint = Adjoint(c_from_b.b_from_a);
  return {
      c_from_b.b_from_a * b_from_a.b_from_a,
      {c_from_b.covariance.matrix + adjoint * b_from_a.covariance.matrix * adjoint.transpose()}};
}

UncertainSimilarity Bend(const Eigen::Vector3d& pivot, double rotation_deviation,
                         double log_scale_deviation) {
  Vector7 variances = Vector7::Zero();
  variances.head<3>().setConstant(rotation_deviation * rotation_deviation);
  variances[6] = log_scale_deviation * log_scale_deviation;
  const Matrix7 from_pivot = Adjoint({1.0, Eigen::Quaterniond::Identity(), pivot});
  return {{}, {from_pivot * variances.asDiagonal() * from_pivot.transpose()}};
}

std::optional<ClosedSimilarity> CloseChain(const UncertainSimilarity& known,
                                           const SeenAcross& seen) {
  const Eigen::LDLT<Matrix7> solver(known.covariance.matrix);
  const Matrix7 information = solver.solve(Matrix7::Identity());
  if (!(solver.vectorD().array() > 0).all() || !information.allFinite()) return std::nullopt;
  Sim3 b_from_a = known.b_from_a;
  for (const double scale_px : kScalesPx) {
    b_from_a = SimilarityStep::Refine(b_from_a, scale_px, [&](SimilarityStep* step) {
      step->AddPrior(information, MotionBetween(known.b_from_a, step->b_from_a()));
      step->AddSightings(seen.in_b, seen.in_a);
      for (const CrossMatch& match : seen.matches) AddMatch(match, step);
    });
  }
  const Vector7 by = MotionBetween(known.b_from_a, b_from_a);
  const double squared = by.dot(information * by);
  if (!(squared >= 0) || !std::isfinite(squared)) return std::nullopt;
  return ClosedSimilarity{b_from_a, std::sqrt(squared)};
}

std::vector<Sim3> SpreadOver(std::span<const UncertainSimilarity> links,
                             const Sim3& first_from_last) {
  std::vector<UncertainSimilarity> known = {links.front()};
  for (const UncertainSimilarity& link : links.subspan(1))
    known.push_back(Chain(known.back(), link));
  const Vector7 by = MotionBetween(known.back().b_from_a, first_from_last);
  const Vector7 shares = known.back().covariance.matrix.ldlt().solve(by);
  std::vector<Sim3> frames;
  for (const UncertainSimilarity& one : known)
    frames.push_back(SimilarityStep::Moved(one.b_from_a, one.covariance.matrix * shares));
  frames.back() = first_from_last;
  return frames;
}

}  // namespace veduta
