// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/similarity.h"

#include <Eigen/Dense>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "engine/mapping/similarity_step.h"
#include "engine/matching/sampling.h"

namespace veduta {
namespace {

// At the confidence below, 2000 triples suffice where a share of 0.166 of the correspondences
// agrees, and 30 where 0.64 does (Fischler and Bolles 1981). Chosen by hand; not measured.
constexpr uint32_t kSamplesMax = 2000, kSamplesMin = 30;
constexpr double kConfidence = 1 - 1e-4;  // as the paper's section 3.2 has it for pairs
constexpr int kRefits = 3;                // to all inliers; chosen by hand, not measured

// Each camera as three points: its centre, and one unit (a typical spacing) along two of its axes,
// so that cameras on a line fix the gauge too.
std::vector<Eigen::Vector3d> Frame(std::span<const Rigid3> cams_from_world) {
  const double n = static_cast<double>(cams_from_world.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Rigid3& pose : cams_from_world) mean += pose.Center() / n;
  double spread = 0;
  for (const Rigid3& pose : cams_from_world) spread += (pose.Center() - mean).squaredNorm() / n;
  std::vector<Eigen::Vector3d> frame;
  for (const Rigid3& pose : cams_from_world) {
    const Eigen::Matrix3d axes = pose.rotation.toRotationMatrix().transpose();
    frame.push_back(pose.Center());
    frame.push_back(pose.Center() + std::sqrt(spread) * axes.col(0));
    frame.push_back(pose.Center() + std::sqrt(spread) * axes.col(2));
  }
  return frame;
}

}  // namespace

std::optional<Sim3> FitSimilarity(std::span<const Eigen::Vector3d> a,
                                  std::span<const Eigen::Vector3d> b) {
  if (a.size() < 3 || a.size() != b.size()) return std::nullopt;
  const double n = static_cast<double>(a.size());
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < a.size(); ++i) mean_a += a[i] / n, mean_b += b[i] / n;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double variance_a = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    covariance += (b[i] - mean_b) * (a[i] - mean_a).transpose() / n;
    variance_a += (a[i] - mean_a).squaredNorm() / n;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d d = svd.singularValues();
  if (!(variance_a > 0) || !(d[1] > 1e-9 * d[0])) return std::nullopt;
  Eigen::Vector3d signs(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs[2] = -1;
  Sim3 fit;
  fit.rotation = Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * signs.asDiagonal() *
                                                    svd.matrixV().transpose()))
                     .normalized();
  fit.scale = d.dot(signs) / variance_a;
  if (!(fit.scale > 0) || !std::isfinite(fit.scale)) return std::nullopt;
  fit.translation = mean_b - fit.scale * (fit.rotation * mean_a);
  return fit;
}

std::optional<Sim3> FitCameras(std::span<const Rigid3> cams_from_a,
                               std::span<const Rigid3> cams_from_b) {
  return FitSimilarity(Frame(cams_from_a), Frame(cams_from_b));
}

std::optional<RobustSimilarity> EstimateSimilarity(
    std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b,
    const std::function<bool(const Sim3&, size_t)>& is_inlier, uint32_t inlier_count_min,
    uint64_t seed) {
  const uint32_t n = static_cast<uint32_t>(a.size());
  if (n < std::max(3u, inlier_count_min)) return std::nullopt;
  const auto count = [&](const Sim3& fit) {
    std::vector<uint32_t> inliers;
    for (uint32_t i = 0; i < n; ++i) {
      if (is_inlier(fit, i)) inliers.push_back(i);
    }
    return inliers;
  };
  SeededRandom random(seed);
  std::vector<int> sample(3);
  RobustSimilarity best;
  uint32_t samples_needed = kSamplesMax;
  for (uint32_t t = 0; t < samples_needed; ++t) {
    DrawDistinct(random, n, sample);
    const Eigen::Vector3d sample_a[3] = {a[sample[0]], a[sample[1]], a[sample[2]]};
    const Eigen::Vector3d sample_b[3] = {b[sample[0]], b[sample[1]], b[sample[2]]};
    const auto fit = FitSimilarity(sample_a, sample_b);
    if (!fit) continue;
    std::vector<uint32_t> inliers = count(*fit);
    if (inliers.size() > best.inliers.size()) {
      best = {*fit, std::move(inliers)};
      samples_needed = std::min(
          samples_needed,
          std::max(kSamplesMin, SamplesNeeded(kConfidence, best.inliers.size() / double(n), 3)));
    }
  }
  for (int round = 0; round < kRefits && best.inliers.size() >= 3; ++round) {
    std::vector<Eigen::Vector3d> in_a, in_b;
    for (const uint32_t i : best.inliers) in_a.push_back(a[i]), in_b.push_back(b[i]);
    const auto fit = FitSimilarity(in_a, in_b);
    if (!fit) break;
    std::vector<uint32_t> inliers = count(*fit);
    if (inliers.size() < best.inliers.size()) break;
    best = {*fit, std::move(inliers)};
  }
  if (best.inliers.size() < inlier_count_min) return std::nullopt;
  return best;
}

double SimilarityCovariance::LogScaleDeviation() const {
  return matrix(6, 6) > 0 ? std::sqrt(matrix(6, 6)) : std::numeric_limits<double>::infinity();
}

double SimilarityCovariance::PositionDeviation(const Eigen::Vector3d& x_b) const {
  const Eigen::Matrix<double, 3, 7> motion = SimilarityStep::MotionOf(x_b);
  const double variance = (motion * matrix * motion.transpose()).trace();
  return variance > 0 ? std::sqrt(variance) : std::numeric_limits<double>::infinity();
}

SimilarityCovariance CovarianceOf(const Sim3& b_from_a, std::span<const CrossSighting> in_b,
                                  std::span<const CrossSighting> in_a, double scale_px) {
  SimilarityStep step(b_from_a, scale_px);
  step.AddSightings(in_b, in_a);
  return {step.normal().ldlt().solve(Eigen::Matrix<double, 7, 7>::Identity())};
}

Sim3 RefineSimilarity(const Sim3& start, std::span<const CrossSighting> in_b,
                      std::span<const CrossSighting> in_a, double scale_px) {
  return SimilarityStep::Refine(start, scale_px,
                                [&](SimilarityStep* step) { step->AddSightings(in_b, in_a); });
}

}  // namespace veduta
