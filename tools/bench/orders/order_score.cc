// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/orders/order_score.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "storage/base/angle.h"
#include "storage/base/content_hash.h"
#include "storage/base/median.h"

namespace veduta::orders {
namespace {

// Of 500 triples, one at least has no bad photo with a probability of 0.998 where three quarters
// of the photos are bad: 1 - (1 - 0.25^3)^500.
constexpr int kTriples = 500;
// Photos nearer than this many robust standard deviations are fitted again, and the deviation is
// 1.4826 (1 + 5 / (n - 3)) times the median: Rousseeuw and Leroy, 1987, chapter 5.
constexpr double kDeviationsMax = 2.5;

struct Posed {
  const PlacedPhoto* photo;
  Rigid3 truth;
};

struct PhotoError {
  std::string name;
  double center_m = 0, rotation_deg = 0;
  double excess = 0;         // how many times the limit the error is, of centre or of rotation
  double excess_robust = 0;  // the same after the robust fit
};

struct Alignment {
  Sim3 truth_from_estimate;
  Eigen::Quaterniond rotation;  // for comparing rotations
  bool is_rotation_apart = false;
};

std::optional<Sim3> FitCenters(const std::vector<Posed>& photos) {
  if (photos.size() < 3) return std::nullopt;
  const Eigen::Index count = static_cast<Eigen::Index>(photos.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    from.col(i) = photos[static_cast<size_t>(i)].photo->cam_from_world.Center();
    to.col(i) = photos[static_cast<size_t>(i)].truth.Center();
  }
  const double spread = (from.colwise() - from.rowwise().mean()).norm();
  if (!(spread > 0) || !std::isfinite(spread)) return std::nullopt;
  const Eigen::Matrix4d fit = Eigen::umeyama(from, to, true);
  if (!fit.allFinite()) return std::nullopt;
  Sim3 similarity;
  similarity.scale = fit.col(0).head<3>().norm();
  if (!(similarity.scale > 0)) return std::nullopt;
  similarity.rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(fit.topLeftCorner<3, 3>() / similarity.scale))
          .normalized();
  similarity.translation = fit.col(3).head<3>();
  return similarity;
}

// The rotation that brings the cameras' rotations nearest to the truth's (chordal mean).
Eigen::Quaterniond FitRotations(const std::vector<Posed>& photos) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Posed& posed : photos) {
    sum += (posed.truth.rotation.conjugate() * posed.photo->cam_from_world.rotation)
               .toRotationMatrix();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d signs = Eigen::Matrix3d::Identity();
  signs(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * signs * svd.matrixV().transpose()));
}

double CenterError(const Sim3& fit, const Posed& posed) {
  return (fit * posed.photo->cam_from_world.Center() - posed.truth.Center()).norm();
}

double RotationErrorDeg(const Eigen::Quaterniond& rotation, const Posed& posed) {
  const Eigen::Quaterniond aligned = posed.photo->cam_from_world.rotation * rotation.conjugate();
  return posed.truth.rotation.angularDistance(aligned) / kRadPerDeg;
}

// How far errors of the centres may turn the fit around the line that the centres nearest lie on,
// as a standard deviation.
double RotationDeviationDeg(const std::vector<Posed>& photos, const Sim3& fit) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Posed& posed : photos)
    mean += posed.truth.Center() / static_cast<double>(photos.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  double squares = 0;
  for (const Posed& posed : photos) {
    const Eigen::Vector3d x = posed.truth.Center() - mean;
    scatter += x * x.transpose();
    squares += std::pow(CenterError(fit, posed), 2);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter, Eigen::EigenvaluesOnly);
  const double off_line = solver.eigenvalues()[0] + solver.eigenvalues()[1];
  const double variance = squares / (3.0 * static_cast<double>(photos.size()));
  return off_line > 0 ? std::sqrt(variance / off_line) / kRadPerDeg : 180;
}

std::optional<Alignment> Align(const std::vector<Posed>& photos, const Limits& limits) {
  const std::optional<Sim3> fit = FitCenters(photos);
  if (!fit) return std::nullopt;
  Alignment alignment = {*fit, fit->rotation, false};
  // A quarter of the limit: three deviations do not reach it. Chosen by hand; not measured.
  if (RotationDeviationDeg(photos, *fit) > limits.rotation_deg / 4) {
    alignment.rotation = FitRotations(photos);
    alignment.is_rotation_apart = true;
  }
  return alignment;
}

std::optional<Alignment> AlignRobustly(const std::vector<Posed>& photos, const Limits& limits) {
  const uint32_t count = static_cast<uint32_t>(photos.size());
  if (count < 4) return Align(photos, limits);
  SeededRandom random(MixSeed(count, 0x0DE5));
  std::optional<Sim3> best;
  double best_median = 0;
  std::vector<double> errors(count);
  const auto measure = [&](const Sim3& fit) {
    for (uint32_t i = 0; i < count; ++i) errors[i] = CenterError(fit, photos[i]);
  };
  for (int t = 0; t < kTriples; ++t) {
    const uint32_t i = random.Below(count), j = random.Below(count), k = random.Below(count);
    if (i == j || j == k || i == k) continue;
    const std::optional<Sim3> fit = FitCenters({photos[i], photos[j], photos[k]});
    if (!fit) continue;
    measure(*fit);
    const double median = MedianOf(errors);
    if (!best || median < best_median) best = fit, best_median = median;
  }
  if (!best) return Align(photos, limits);
  const double deviation = 1.4826 * (1 + 5.0 / (count - 3)) * best_median;
  measure(*best);
  std::vector<Posed> near;
  for (uint32_t i = 0; i < count; ++i) {
    if (errors[i] <= kDeviationsMax * deviation) near.push_back(photos[i]);
  }
  return Align(near, limits);
}

double Excess(const Posed& posed, const Alignment& alignment, const Limits& limits) {
  return std::max(CenterError(alignment.truth_from_estimate, posed) / limits.center_m,
                  RotationErrorDeg(alignment.rotation, posed) / limits.rotation_deg);
}

void Summarize(const std::vector<PhotoError>& errors, GroupScore* score) {
  std::vector<double> centers;
  double worst = -1;
  for (const PhotoError& error : errors) {
    centers.push_back(error.center_m);
    score->center_mean_m += error.center_m / static_cast<double>(errors.size());
    score->center_max_m = std::max(score->center_max_m, error.center_m);
    score->rotation_max_deg = std::max(score->rotation_max_deg, error.rotation_deg);
    score->wrong += error.excess > 1 ? 1 : 0;
    score->wrong_robust += error.excess_robust > 1 ? 1 : 0;
    if (error.excess_robust > worst) worst = error.excess_robust, score->worst = error.name;
  }
  score->center_median_m = MedianOf(std::move(centers));
}

GroupScore ScoreGroup(const std::vector<Posed>& photos, const Limits& limits,
                      std::vector<PhotoError>* all) {
  GroupScore score;
  score.reconstruction = photos.front().photo->reconstruction;
  score.photos = static_cast<uint32_t>(photos.size());
  const std::optional<Alignment> alignment = Align(photos, limits);
  if (!alignment) return score;
  const Alignment robust = AlignRobustly(photos, limits).value_or(*alignment);
  score.is_fitted = true;
  score.is_rotation_apart = alignment->is_rotation_apart;
  std::vector<PhotoError> errors;
  for (const Posed& posed : photos) {
    errors.push_back({posed.photo->name, CenterError(alignment->truth_from_estimate, posed),
                      RotationErrorDeg(alignment->rotation, posed),
                      Excess(posed, *alignment, limits), Excess(posed, robust, limits)});
  }
  Summarize(errors, &score);
  all->insert(all->end(), errors.begin(), errors.end());
  return score;
}

}  // namespace

double CenterLimit(std::optional<double> error_m, std::optional<double> error_share,
                   double extent_m) {
  if (!error_m && !error_share) error_m = 0.5, error_share = 0.005;
  return std::max(error_m.value_or(0), error_share.value_or(0) * extent_m);
}

OrderScore ScoreRun(const OrderRun& run, const Truth& truth, const Limits& limits) {
  OrderScore score;
  std::map<uint32_t, std::vector<Posed>> groups;
  for (const PlacedPhoto& photo : run.poses) {
    const std::string name = photo.name.substr(photo.name.rfind('/') + 1);
    const auto found = truth.find(name);
    if (found == truth.end()) {
      ++score.without_truth;
    } else {
      groups[photo.reconstruction].push_back({&photo, found->second});
    }
  }
  std::vector<PhotoError> all;
  for (const auto& [id, photos] : groups) {
    score.reconstructions.push_back(ScoreGroup(photos, limits, &all));
  }
  std::ranges::stable_sort(score.reconstructions, std::ranges::greater(), &GroupScore::photos);
  score.all.photos = static_cast<uint32_t>(all.size());
  score.all.is_fitted = !all.empty();
  Summarize(all, &score.all);
  score.is_wrong = !run.failure.empty() || score.all.wrong > 0;
  return score;
}

}  // namespace veduta::orders
