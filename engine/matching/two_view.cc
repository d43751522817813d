// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/two_view.h"

#include <Eigen/Dense>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "engine/matching/five_point.h"
#include "engine/matching/homography.h"
#include "engine/matching/sampling.h"
#include "storage/base/cross_matrix.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Depths are positive when the least-squares crossing of the two rays lies ahead of both cameras.
bool IsInFront(const Rigid3& b_from_a, const Eigen::Vector2d& x_a, const Eigen::Vector2d& x_b) {
  const Eigen::Vector3d ra = b_from_a.rotation * x_a.homogeneous();
  const Eigen::Vector3d rb = x_b.homogeneous();
  const Eigen::Vector3d& t = b_from_a.translation;
  const double aa = ra.dot(ra), ab = ra.dot(rb), bb = rb.dot(rb), at = ra.dot(t), bt = rb.dot(t);
  // Normal equations of depth_a * ra + t = depth_b * rb; their determinant is never negative.
  return ab * bt - bb * at > 0 && aa * bt - ab * at > 0;
}

uint32_t CountSampson(const Eigen::Matrix3d& e, const MatchArrays& m, double distance_max,
                      uint32_t give_up_below) {
  const double limit = distance_max * distance_max;
  const size_t n = m.size();
  uint32_t inliers = 0;
  for (size_t begin = 0; begin < n; begin += 64) {
    const size_t end = std::min(n, begin + 64);
    if (inliers + (n - begin) < give_up_below) return 0;  // cannot beat the best any more
    for (size_t i = begin; i < end; ++i) {
      const double lx = e(0, 0) * m.ax[i] + e(0, 1) * m.ay[i] + e(0, 2);
      const double ly = e(1, 0) * m.ax[i] + e(1, 1) * m.ay[i] + e(1, 2);
      const double lz = e(2, 0) * m.ax[i] + e(2, 1) * m.ay[i] + e(2, 2);
      const double mx = e(0, 0) * m.bx[i] + e(1, 0) * m.by[i] + e(2, 0);
      const double my = e(0, 1) * m.bx[i] + e(1, 1) * m.by[i] + e(2, 1);
      const double r = m.bx[i] * lx + m.by[i] * ly + lz;
      inliers += r * r < limit * (lx * lx + ly * ly + mx * mx + my * my);
    }
  }
  return inliers;
}

template <typename T>
std::vector<T> Select(std::span<const T> values, std::span<const uint32_t> indices) {
  std::vector<T> selected;
  selected.reserve(indices.size());
  for (const uint32_t i : indices) selected.push_back(values[i]);
  return selected;
}

struct BestPose {
  Rigid3 b_from_a;
  uint32_t inliers = 0;
};

// Refines the solution of one sample on all matches that it explains: the noise of five matches
// hides most of the inliers (Chum, Matas and Kittler 2003).
BestPose Optimize(const Eigen::Matrix3d& essential, std::span<const Eigen::Vector2d> x_a,
                  std::span<const Eigen::Vector2d> x_b, double distance_max) {
  BestPose best{PoseFromEssential(essential, x_a, x_b), 0};
  for (int round = 0; round < 2; ++round) {
    // The first round also takes matches that noise pushed just out of reach.
    const std::vector<uint32_t> near =
        FindTwoViewInliers(best.b_from_a, x_a, x_b, (round == 0 ? 2.0 : 1.0) * distance_max);
    if (near.size() < 8) return best;
    best.b_from_a =
        RefineTwoView(best.b_from_a, Select(x_a, near), Select(x_b, near), 0.5 * distance_max);
  }
  best.inliers =
      static_cast<uint32_t>(FindTwoViewInliers(best.b_from_a, x_a, x_b, distance_max).size());
  return best;
}

// RANSAC over samples of five matches.
BestPose SearchPose(std::span<const Eigen::Vector2d> x_a, std::span<const Eigen::Vector2d> x_b,
                    double distance_max, uint32_t inliers_needed, uint64_t seed,
                    const TwoViewOptions& options) {
  const uint32_t n = static_cast<uint32_t>(x_a.size());
  const MatchArrays matches(x_a, x_b);
  SeededRandom random(seed);
  BestPose best;
  uint32_t best_sample = 0;  // inliers of the best solution before refinement
  uint32_t samples_needed = options.samples_max;
  std::vector<int> sample(5);
  for (uint32_t t = 0; t < samples_needed; ++t) {
    if (t == options.samples_hopeless && best.inliers < inliers_needed / 2) break;
    DrawDistinct(random, FrontCount(n, t, 20), sample);
    std::array<Eigen::Vector3d, 5> rays_a, rays_b;
    for (size_t k = 0; k < sample.size(); ++k) {
      rays_a[k] = x_a[sample[k]].homogeneous();
      rays_b[k] = x_b[sample[k]].homogeneous();
    }
    const EssentialMatrices solutions = SolveFivePoint(rays_a, rays_b);
    for (const Eigen::Matrix3d& essential : solutions.all()) {
      const uint32_t inliers = CountSampson(essential, matches, distance_max, best_sample + 1);
      if (inliers <= best_sample) continue;
      best_sample = inliers;
      const BestPose optimized = Optimize(essential, x_a, x_b, distance_max);
      if (optimized.inliers <= best.inliers) continue;
      best = optimized;
      samples_needed = std::min(options.samples_max,
                                SamplesNeeded(options.confidence, best.inliers / double(n), 5));
      samples_needed = std::max(samples_needed, options.samples_min);
    }
  }
  return best;
}

}  // namespace

Status TwoViewOptions::Check() const {
  return OptionBounds()
      .Inside("error_px_max", error_px_max, 0, 100)
      .Inside("confidence", confidence, 0, 1)
      .AtLeast("inlier_count_min", inlier_count_min, 5)
      .Between("inlier_share_min", inlier_share_min, 0, 1)
      .AtLeast("samples_max", samples_max, 1)
      .Between("samples_min", samples_min, 0, samples_max)
      .Between("planar_share_min", planar_share_min, 0, 1)
      .Between("rotation_share_min", rotation_share_min, 0, 1)
      .status();
}

double SampsonDistance(const Eigen::Matrix3d& e, const Eigen::Vector2d& x_a,
                       const Eigen::Vector2d& x_b) {
  return std::abs(SignedSampsonDistance(e, x_a, x_b));
}

double SignedSampsonDistance(const Eigen::Matrix3d& e, const Eigen::Vector2d& x_a,
                             const Eigen::Vector2d& x_b) {
  const Eigen::Vector3d a = x_a.homogeneous(), b = x_b.homogeneous();
  const Eigen::Vector3d line_b = e * a, line_a = e.transpose() * b;
  const double scale = line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm();
  return scale > 0 ? b.dot(line_b) / std::sqrt(scale) : b.dot(line_b);
}

Eigen::Matrix3d EssentialFromPose(const Rigid3& b_from_a) {
  return CrossMatrix(b_from_a.translation) * b_from_a.rotation.toRotationMatrix();
}

Rigid3 PoseFromEssential(const Eigen::Matrix3d& essential, std::span<const Eigen::Vector2d> x_a,
                         std::span<const Eigen::Vector2d> x_b) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (u.determinant() < 0) u.col(2) *= -1;
  if (v.determinant() < 0) v.col(2) *= -1;
  Eigen::Matrix3d w;
  w << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  Rigid3 best;
  size_t best_count = 0;
  bool have_best = false;
  for (int k = 0; k < 4; ++k) {
    Rigid3 pose;
    pose.rotation =
        Eigen::Quaterniond(u * (k < 2 ? w : w.transpose()) * v.transpose()).normalized();
    pose.translation = (k % 2 == 0 ? 1.0 : -1.0) * u.col(2);
    size_t count = 0;
    for (size_t i = 0; i < x_a.size(); ++i) count += IsInFront(pose, x_a[i], x_b[i]);
    if (!have_best || count > best_count) best = pose, best_count = count, have_best = true;
  }
  return best;
}

Rigid3 RefineTwoView(const Rigid3& start, std::span<const Eigen::Vector2d> x_a,
                     std::span<const Eigen::Vector2d> x_b, double scale) {
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  Rigid3 pose = start;
  pose.translation.normalize();
  for (int iteration = 0; iteration < 10; ++iteration) {
    const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
    const Eigen::Vector3d t = pose.translation;
    const Eigen::Vector3d basis_0 = t.unitOrthogonal(), basis_1 = t.cross(basis_0);
    const Eigen::Matrix3d e = CrossMatrix(t) * r;
    std::array<Eigen::Matrix3d, 5>
        de;  // derivative of E by rotation (3, on the right) and direction (2)
    for (int k = 0; k < 3; ++k) de[k] = e * CrossMatrix(Eigen::Vector3d::Unit(k));
    de[3] = CrossMatrix(basis_0) * r;
    de[4] = CrossMatrix(basis_1) * r;
    Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
    Vector5 gradient = Vector5::Zero();
    for (size_t i = 0; i < x_a.size(); ++i) {
      const Eigen::Vector3d a = x_a[i].homogeneous(), b = x_b[i].homogeneous();
      const Eigen::Vector3d line_b = e * a, line_a = e.transpose() * b;
      const double norm =
          std::sqrt(line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm());
      if (!(norm > 0)) continue;
      const double residual = b.dot(line_b) / norm;
      const double weight = 1.0 / (1.0 + residual * residual / (scale * scale));
      Vector5 jacobian;  // of the numerator; the slowly varying norm is held
      for (int k = 0; k < 5; ++k) jacobian[k] = b.dot(de[k] * a) / norm;
      normal += weight * jacobian * jacobian.transpose();
      gradient += weight * residual * jacobian;
    }
    normal.diagonal().array() += 1e-12 * normal.trace() + 1e-300;
    const Vector5 step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) break;
    const Eigen::Vector3d omega = step.head<3>();
    if (omega.norm() > 0) {
      pose.rotation =
          (pose.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm(), omega.normalized())))
              .normalized();
    }
    pose.translation = (t + step[3] * basis_0 + step[4] * basis_1).normalized();
    if (step.norm() < 1e-10) break;
  }
  return pose;
}

std::vector<uint32_t> FindTwoViewInliers(const Rigid3& b_from_a,
                                         std::span<const Eigen::Vector2d> x_a,
                                         std::span<const Eigen::Vector2d> x_b,
                                         double distance_max) {
  const Eigen::Matrix3d e = EssentialFromPose(b_from_a);
  std::vector<uint32_t> inliers;
  for (uint32_t i = 0; i < x_a.size(); ++i) {
    if (SampsonDistance(e, x_a[i], x_b[i]) < distance_max && IsInFront(b_from_a, x_a[i], x_b[i]))
      inliers.push_back(i);
  }
  return inliers;
}

uint32_t CountRotationInliers(std::span<const Eigen::Vector2d> x_a,
                              std::span<const Eigen::Vector2d> x_b, double distance_max,
                              uint64_t seed) {
  const uint32_t n = static_cast<uint32_t>(x_a.size());
  if (n < 2) return 0;
  SeededRandom random(seed);
  std::vector<int> sample(2);
  uint32_t best = 0;
  for (int t = 0; t < 60; ++t) {
    DrawDistinct(random, n, sample);
    Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
    for (const int i : sample) {
      correlation +=
          x_b[i].homogeneous().normalized() * x_a[i].homogeneous().normalized().transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
    const Eigen::Matrix3d r = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    uint32_t count = 0;
    for (uint32_t i = 0; i < n; ++i) {
      const Eigen::Vector3d p = r * x_a[i].homogeneous();
      count += p.z() > 0 && (p.hnormalized() - x_b[i]).norm() < distance_max;
    }
    best = std::max(best, count);
  }
  return best;
}

uint32_t CountHomographyInliers(std::span<const Eigen::Vector2d> x_a,
                                std::span<const Eigen::Vector2d> x_b, double distance_max,
                                uint64_t seed) {
  return FindHomography(x_a, x_b, distance_max, /*sample_count=*/60, seed).inlier_count;
}

PairGeometry Classify(std::span<const Eigen::Vector2d> x_a, std::span<const Eigen::Vector2d> x_b,
                      std::span<const uint32_t> inliers, double focal_px, uint64_t seed,
                      const TwoViewOptions& options) {
  const std::vector<Eigen::Vector2d> in_a = Select(x_a, inliers), in_b = Select(x_b, inliers);
  const double count = static_cast<double>(inliers.size());
  const double distance_max = options.error_px_max / focal_px;
  if (CountRotationInliers(in_a, in_b, distance_max, MixSeed(seed, 1)) >=
      options.rotation_share_min * count)
    return PairGeometry::kRotation;
  if (CountHomographyInliers(in_a, in_b, distance_max, MixSeed(seed, 2)) >=
      options.planar_share_min * count)
    return PairGeometry::kPlanar;
  return PairGeometry::kGeneral;
}

namespace {

// Matches that lie at the same place in both photos. Of these the five-point algorithm makes
// nothing, for any translation explains them.
std::vector<uint32_t> FindStandingStill(std::span<const Eigen::Vector2d> x_a,
                                        std::span<const Eigen::Vector2d> x_b, double distance_max) {
  std::vector<uint32_t> still;
  for (uint32_t i = 0; i < x_a.size(); ++i)
    if ((x_a[i] - x_b[i]).norm() <= distance_max) still.push_back(i);
  return still;
}

}  // namespace

TwoViewGeometry EstimateTwoView(std::span<const Eigen::Vector2d> x_a,
                                std::span<const Eigen::Vector2d> x_b, double focal_px,
                                uint64_t seed, const TwoViewOptions& options) {
  TwoViewGeometry result;
  if (x_a.size() < options.inlier_count_min || x_a.size() != x_b.size()) return result;
  result.outcome = TwoViewOutcome::kTooFewInliers;
  const double distance_max = options.error_px_max / focal_px;
  const uint32_t needed = std::max(
      options.inlier_count_min,
      static_cast<uint32_t>(std::ceil(options.inlier_share_min * static_cast<double>(x_a.size()))));
  std::vector<uint32_t> still = FindStandingStill(x_a, x_b, distance_max);
  if (still.size() >= needed && static_cast<double>(still.size()) >=
                                    options.rotation_share_min * static_cast<double>(x_a.size())) {
    result.outcome = TwoViewOutcome::kVerified;
    result.geometry = PairGeometry::kRotation;
    result.b_from_a.translation = Eigen::Vector3d::UnitZ();
    result.b_from_a = RefineTwoView(result.b_from_a, x_a, x_b, 0.5 * distance_max);
    result.inliers = std::move(still);
    return result;
  }
  const BestPose best = SearchPose(x_a, x_b, distance_max, needed, seed, options);
  if (best.inliers == 0) return result;
  result.b_from_a = best.b_from_a;
  result.inliers = FindTwoViewInliers(best.b_from_a, x_a, x_b, distance_max);
  if (result.inliers.size() < needed) return result;
  result.outcome = TwoViewOutcome::kVerified;
  result.geometry = Classify(x_a, x_b, result.inliers, focal_px, seed, options);
  return result;
}

}  // namespace veduta
