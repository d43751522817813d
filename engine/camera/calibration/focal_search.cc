// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/focal_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/camera/calibration/homography_decomposition.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

using NormalPair = std::array<Eigen::Vector3d, 2>;

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

std::vector<NormalPair> Normals(std::span<const Eigen::Matrix3d> homographies, double focal) {
  std::vector<NormalPair> normals;
  normals.reserve(homographies.size());
  const Eigen::Vector3d k(focal, focal, 1);
  for (const Eigen::Matrix3d& h : homographies) {
    const auto motions = DecomposeHomography(k.cwiseInverse().asDiagonal() * h * k.asDiagonal());
    normals.push_back({motions[0].normal_in_a, motions[1].normal_in_a});
  }
  return normals;
}

// Equation 3 (or 4): the sum of the angles between a mean and the nearer normal of every pair.
double SumOfAngles(const std::vector<NormalPair>& normals, const Eigen::Vector3d& mean) {
  double sum = 0;
  for (const NormalPair& pair : normals)
    sum += std::min(AngleBetween(pair[0], mean), AngleBetween(pair[1], mean));
  return sum;
}

// The better of the most separated pair, and its sum of angles.
std::pair<double, Eigen::Vector3d> BestMean(const std::vector<NormalPair>& normals) {
  const NormalPair* most_separated = &normals.front();
  for (const NormalPair& pair : normals) {
    if (pair[0].dot(pair[1]) < (*most_separated)[0].dot((*most_separated)[1]))
      most_separated = &pair;
  }
  const double plus = SumOfAngles(normals, (*most_separated)[0]);
  const double minus = SumOfAngles(normals, (*most_separated)[1]);
  return plus <= minus ? std::pair(plus, (*most_separated)[0])
                       : std::pair(minus, (*most_separated)[1]);
}

}  // namespace

Status FocalSearchOptions::Check() const {
  return OptionBounds()
      .FiniteAbove("focal_min", focal_min, 0)
      .FiniteAbove("focal_max", focal_max, focal_min)
      .Between("step_count", step_count, 8, 10'000)
      .status();
}

std::optional<FocalEstimate> SearchFocalLength(
    std::span<const std::vector<Eigen::Matrix3d>> other_from_reference,
    const FocalSearchOptions& options) {
  const Status status = options.Check();
  VEDUTA_CHECK(status.ok(), status.message());
  size_t count = 0;
  for (const auto& homographies : other_from_reference) count += homographies.size();
  if (count == 0) return std::nullopt;
  const auto score = [&](double log_focal) {
    double sum = 0;
    for (const auto& homographies : other_from_reference) {
      if (!homographies.empty()) sum += BestMean(Normals(homographies, std::exp(log_focal))).first;
    }
    return sum;
  };

  const double low = std::log(options.focal_min), high = std::log(options.focal_max);
  const double step = (high - low) / options.step_count;
  double best = low, best_score = score(low);
  for (uint32_t i = 1; i <= options.step_count; ++i) {
    const double s = score(low + i * step);
    if (s < best_score) best_score = s, best = low + i * step;
  }
  // Golden section between the neighbours of the best step.
  double left = std::max(best - step, low), right = std::min(best + step, high);
  constexpr double kGolden = 1 / std::numbers::phi;
  constexpr int kRefinements = 10;  // leave 2 * 5 % * phi^-10 = 0.08 % open; chosen by hand
  for (int i = 0; i < kRefinements; ++i) {
    const double a = right - kGolden * (right - left), b = left + kGolden * (right - left);
    score(a) < score(b) ? right = b : left = a;
  }
  const double refined = (left + right) / 2, refined_score = score(refined);
  if (refined_score < best_score) best_score = refined_score, best = refined;
  return FocalEstimate{std::exp(best),
                       best_score / static_cast<double>(count) * 180 / std::numbers::pi};
}

Eigen::Vector3d AgreedNormal(std::span<const Eigen::Matrix3d> other_from_reference, double focal) {
  return BestMean(Normals(other_from_reference, focal)).second;
}

}  // namespace veduta
