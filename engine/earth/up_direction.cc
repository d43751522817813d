// SPDX-License-Identifier: Apache-2.0
#include "engine/earth/up_direction.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace veduta {
namespace {

// How far photos are rolled, and pitched: standard deviations. A person photographs houses with the
// camera tilted up. All chosen by hand; not measured.
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRollDeviation = 5 * kDegree, kPitchDeviation = 15 * kDegree;
// Photos whose tilts count as independent.
constexpr double kIndependentMax = 4;
constexpr int kRounds = 10;
// That level photos are all held upside down: one in some millions. Chosen by hand.
constexpr double kUpsideDownDoubt = 30;

// Cauchy's weight of an error in standard deviations: half at two.
double WeightOf(double error) {
  return 1 / (1 + error * error / 4);
}

// A photo's axes to the right and forward are level, each as far as it agrees that it is.
Eigen::Matrix3d InformationAt(std::span<const Rigid3> cams, const Eigen::Vector3d& up) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Rigid3& cam : cams) {
    const Eigen::Matrix3d r = cam.rotation.toRotationMatrix();
    const Eigen::Vector3d right = r.row(0), forward = r.row(2);
    const double roll = right.dot(up) / kRollDeviation, pitch = forward.dot(up) / kPitchDeviation;
    sum += WeightOf(roll) / (kRollDeviation * kRollDeviation) * right * right.transpose();
    sum += WeightOf(pitch) / (kPitchDeviation * kPitchDeviation) * forward * forward.transpose();
  }
  const auto count = static_cast<double>(cams.size());
  return sum * std::min(1.0, kIndependentMax / count);
}

// The direction near `start` in which the photos agree most.
UpDirection Refine(std::span<const Rigid3> cams, Eigen::Vector3d start) {
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(InformationAt(cams, start));
    const Eigen::Vector3d level = axes.eigenvectors().col(0);
    start = level.dot(start) < 0 ? Eigen::Vector3d(-level) : level;
  }
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - start * start.transpose();
  return {start, across * InformationAt(cams, start) * across};
}

}  // namespace

std::vector<UpDirection> FindUp(std::span<const Rigid3> cams_from_world) {
  if (cams_from_world.empty()) return {};
  Eigen::Vector3d held = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rights = Eigen::Matrix3d::Zero();
  for (const Rigid3& cam : cams_from_world) {
    const Eigen::Matrix3d r = cam.rotation.toRotationMatrix();
    held -= r.row(1).transpose();
    rights += r.row(0).transpose() * r.row(0);
  }
  std::vector<Eigen::Vector3d> starts;
  if (held.norm() > 1e-6) starts.push_back(held.normalized());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(rights);
  const Eigen::Vector3d level = axes.eigenvectors().col(0);
  starts.push_back(level.dot(held) < 0 ? Eigen::Vector3d(-level) : level);
  starts.push_back(-starts.back());
  std::vector<UpDirection> found;
  for (const Eigen::Vector3d& start : starts) {
    UpDirection up = Refine(cams_from_world, start);
    const double held_up = held.dot(up.up) / static_cast<double>(cams_from_world.size());
    if (held_up < 0) up.doubt = kUpsideDownDoubt * held_up * held_up;
    const bool is_new = std::ranges::none_of(
        found, [&](const UpDirection& other) { return other.up.dot(up.up) > 0.999; });
    if (is_new) found.push_back(std::move(up));
  }
  return found;
}

}  // namespace veduta
