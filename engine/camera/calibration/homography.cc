// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/homography.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// 1000 samples suffice where a third of the pairs agree: 1000 (1/3)^4 = 12 good samples, and none
// with a chance of e^-12.
constexpr uint32_t kSamplesMax = 1000;
constexpr double kConfidence = 1 - 1e-6;  // that one sample is free of outliers; chosen by hand
constexpr size_t kInliersMin = 6;         // two more than the four that always agree

// The similarity that brings points to mean 0 and mean distance sqrt(2).
std::optional<Eigen::Matrix3d> Normalization(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p / static_cast<double>(points.size());
  double distance = 0;
  for (const Eigen::Vector2d& p : points)
    distance += (p - mean).norm() / static_cast<double>(points.size());
  if (!(distance > 0)) return std::nullopt;
  const double scale = std::sqrt(2.0) / distance;
  Eigen::Matrix3d t;
  t << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return t;
}

// Scales H to unit norm, with the sign that gives most of the points a positive third coordinate.
Eigen::Matrix3d Oriented(const Eigen::Matrix3d& h, std::span<const Eigen::Vector2d> a) {
  const auto behind = std::count_if(a.begin(), a.end(), [&](const Eigen::Vector2d& p) {
    return h.row(2).dot(p.homogeneous()) < 0;
  });
  const bool flip = 2 * static_cast<size_t>(behind) > a.size();
  return h / (flip ? -h.norm() : h.norm());
}

// The exact homography of four pairs: every other entry over the last.
std::optional<Eigen::Matrix3d> FitFour(const std::array<Eigen::Vector2d, 4>& a,
                                       const std::array<Eigen::Vector2d, 4>& b) {
  Eigen::Matrix<double, 8, 8> m = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> rhs;
  for (int i = 0; i < 4; ++i) {
    m.block<1, 3>(2 * i, 0) = a[i].homogeneous().transpose();
    m.block<1, 3>(2 * i + 1, 3) = a[i].homogeneous().transpose();
    m.block<2, 2>(2 * i, 6) = -b[i] * a[i].transpose();
    rhs.segment<2>(2 * i) = b[i];
  }
  const Eigen::Matrix<double, 8, 1> h = m.partialPivLu().solve(rhs);
  if (!h.allFinite()) return std::nullopt;
  Eigen::Matrix3d result;
  result << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return result;
}

// The sum of squared errors, each cut off at the bound. A point that goes behind counts as the
// bound.
double Score(const Eigen::Matrix3d& h, std::span<const Eigen::Vector2d> a,
             std::span<const Eigen::Vector2d> b, double error_max, std::vector<uint32_t>* inliers) {
  inliers->clear();
  double score = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const Eigen::Vector3d p = h * a[i].homogeneous();
    const double error = p.z() > 0 ? (p.hnormalized() - b[i]).norm() : error_max;
    if (error < error_max) inliers->push_back(static_cast<uint32_t>(i));
    score += std::min(error * error, error_max * error_max);
  }
  return score;
}

template <typename Values>
std::vector<typename Values::value_type> Select(Values values,
                                                const std::vector<uint32_t>& indices) {
  std::vector<typename Values::value_type> selected;
  for (const uint32_t i : indices) selected.push_back(values[i]);
  return selected;
}

std::array<uint32_t, 4> DrawFour(SeededRandom* random, size_t count) {
  std::array<uint32_t, 4> drawn{};
  for (size_t k = 0; k < 4;) {
    drawn[k] = random->Below(static_cast<uint32_t>(count));
    if (std::find(drawn.begin(), drawn.begin() + k, drawn[k]) == drawn.begin() + k) ++k;
  }
  return drawn;
}

// (measured - true place) / sigma in a, over the true place [2].
struct PlaceCost {
  Eigen::Vector2d measured;
  double sigma;
  template <typename T>
  bool operator()(const T* place, T* residual) const {
    for (int k = 0; k < 2; ++k) residual[k] = (place[k] - measured[k]) / sigma;
    return true;
  }
};

// (H * true place - measured) / sigma in b, over H [9], row-major, and the true place [2].
struct TransferCost {
  Eigen::Vector2d measured;
  double sigma;
  template <typename T>
  bool operator()(const T* h, const T* place, T* residual) const {
    const T w = h[6] * place[0] + h[7] * place[1] + h[8];
    if (w == T(0)) return false;
    for (int k = 0; k < 2; ++k) {
      residual[k] =
          ((h[3 * k] * place[0] + h[3 * k + 1] * place[1] + h[3 * k + 2]) / w - measured[k]) /
          sigma;
    }
    return true;
  }
};

}  // namespace

std::optional<Eigen::Matrix3d> FitHomography(std::span<const Eigen::Vector2d> a,
                                             std::span<const Eigen::Vector2d> b) {
  if (a.size() < 4 || a.size() != b.size()) return std::nullopt;
  const auto normal_a = Normalization(a), normal_b = Normalization(b);
  if (!normal_a || !normal_b) return std::nullopt;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(2 * a.size()), 9);
  for (size_t i = 0; i < a.size(); ++i) {
    const Eigen::RowVector3d from = (*normal_a * a[i].homogeneous()).transpose();
    const Eigen::Vector3d to = *normal_b * b[i].homogeneous();
    const auto row = static_cast<Eigen::Index>(2 * i);
    rows.block<1, 3>(row, 0) = from;
    rows.block<1, 3>(row, 6) = -to.x() * from;
    rows.block<1, 3>(row + 1, 3) = from;
    rows.block<1, 3>(row + 1, 6) = -to.y() * from;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(rows.transpose() * rows);
  // Of squared singular values, about rounding. A second one that vanishes leaves H open.
  constexpr double kRankTolerance = 1e-12;
  if (!(eigen.eigenvalues()[1] > kRankTolerance * eigen.eigenvalues()[8])) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = eigen.eigenvectors().col(0);
  Eigen::Matrix3d normalized;
  normalized << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  const Eigen::Matrix3d fitted = normal_b->inverse() * normalized * *normal_a;
  if (!fitted.allFinite() || !(fitted.norm() > 0)) return std::nullopt;
  return Oriented(fitted, a);
}

std::optional<RobustHomography> EstimateHomography(std::span<const Eigen::Vector2d> a,
                                                   std::span<const Eigen::Vector2d> b,
                                                   double error_max, uint64_t seed) {
  if (a.size() < kInliersMin || a.size() != b.size()) return std::nullopt;
  SeededRandom random(seed);
  RobustHomography best, tried;
  double best_score = std::numeric_limits<double>::infinity();
  double samples_needed = kSamplesMax;
  const auto consider = [&](const std::optional<Eigen::Matrix3d>& h) {
    if (!h) return;
    tried.b_from_a = Oriented(*h, a);
    const double score = Score(tried.b_from_a, a, b, error_max, &tried.inliers);
    if (score >= best_score) return;
    best_score = score;
    std::swap(best, tried);
    const double share = static_cast<double>(best.inliers.size()) / static_cast<double>(a.size());
    samples_needed = share >= 1 ? 0 : std::log(1 - kConfidence) / std::log1p(-std::pow(share, 4));
  };
  consider(FitHomography(a, b));
  for (uint32_t sample = 0; sample < kSamplesMax && sample < samples_needed; ++sample) {
    std::array<Eigen::Vector2d, 4> from, to;
    const std::array<uint32_t, 4> drawn = DrawFour(&random, a.size());
    for (size_t k = 0; k < 4; ++k) from[k] = a[drawn[k]], to[k] = b[drawn[k]];
    consider(FitFour(from, to));
  }
  for (int i = 0; i < 3 && best.inliers.size() >= kInliersMin; ++i) {
    consider(FitHomography(Select(a, best.inliers), Select(b, best.inliers)));
  }
  if (best.inliers.size() < kInliersMin) return std::nullopt;
  return best;
}

Eigen::Matrix3d RefineHomography(const Eigen::Matrix3d& start, std::span<const Eigen::Vector2d> a,
                                 std::span<const Eigen::Vector2d> b,
                                 std::span<const double> sigma_a, std::span<const double> sigma_b) {
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> h = start / start.norm();
  std::vector<Eigen::Vector2d> places(a.begin(), a.end());
  ceres::Problem problem;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (size_t i = 0; i < a.size(); ++i) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PlaceCost, 2, 2>(new PlaceCost{a[i], sigma_a[i]}), nullptr,
        places[i].data());
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<TransferCost, 2, 9, 2>(new TransferCost{b[i], sigma_b[i]}),
        nullptr, h.data(), places[i].data());
    ordering->AddElementToGroup(places[i].data(), 0);
  }
  problem.SetManifold(h.data(), new ceres::SphereManifold<9>());  // the scale of H means nothing
  ordering->AddElementToGroup(h.data(), 1);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = ordering;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable() ? Eigen::Matrix3d(h) : start;
}

}  // namespace veduta
