// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/lens_deviation.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "engine/mapping/camera_system.h"
#include "engine/mapping/lens_solver.h"

namespace veduta {
namespace {

// Cells across a picture's width, as in network_covariance.cc.
constexpr double kCellsAcross = 4;
// By this share the diagonal grows, for the scale of the whole is left open: it changes no focal
// length, so that it takes no part in what is solved for.
constexpr double kDamping = 1e-8;

using Matrix26d = Eigen::Matrix<double, 2, 6>;
// A part of one image's picture.
using Cell = std::array<int64_t, 3>;

// What one image sees of one point: derivatives of the error by the point and by the image's pose
// and focal length, each times the weight of Cauchy's loss. These and the error are also times the
// root of what the point counts (PointWeight).
struct Seen {
  uint32_t image = 0;
  Matrix23d by_point;
  Matrix26d by_pose;
  Eigen::Vector2d by_log_focal, error, x_px;
};

class Network {
 public:
  Network(const BundleOptions& options, std::span<const std::optional<uint32_t>> lens_of,
          uint32_t lens_count, const BundleProblem& problem)
      : options_(options),
        lens_of_(lens_of),
        lens_count_(lens_count),
        problem_(problem),
        pattern_(problem) {}

  std::vector<double> Deviations() const {
    const std::vector<double> none(lens_count_, 0.0);
    Sums sums;
    sums.right.setZero(Row(problem_.free_count), lens_count_);
    sums.lenses.setZero(lens_count_, lens_count_);
    sums.system.SetZero(pattern_);
    std::vector<Seen> all;
    for (size_t point = 0; point < problem_.points.size(); ++point) {
      Look(point, &all);
      Eigen::Matrix3d inverse;
      if (InvertPoint(all, &inverse)) Eliminate(all, inverse, &sums);
    }
    // How poses move when a focal length grows and all that is seen is to be explained.
    SystemSolver poses(pattern_, problem_.free_count <= options_.dense_images_max);
    const std::optional<Eigen::MatrixXd> follow = poses.Solve(sums.system, kDamping, sums.right);
    if (!follow) return none;
    Eigen::MatrixXd information = sums.lenses - sums.right.transpose() * *follow;
    const Eigen::VectorXd told = information.diagonal();
    Eigen::MatrixXd spread = SpreadOfScores(*follow);
    constexpr double kPrior = 1 / (kLensFocalShare * kLensFocalShare);
    information.diagonal().array() += kPrior;
    spread.diagonal().array() += kPrior;
    const Eigen::LLT<Eigen::MatrixXd> solver(information);
    if (solver.info() != Eigen::Success) return none;
    const Eigen::MatrixXd inverse =
        solver.solve(Eigen::MatrixXd::Identity(lens_count_, lens_count_));
    const Eigen::MatrixXd covariance = inverse * spread * inverse;
    std::vector<double> deviations = none;
    for (Eigen::Index lens = 0; lens < covariance.rows(); ++lens) {
      const double deviation = std::sqrt(covariance(lens, lens));
      if (told[lens] > 0 && std::isfinite(deviation))
        deviations[static_cast<size_t>(lens)] = deviation;
    }
    return deviations;
  }

 private:
  // Without what is behind a camera.
  void Look(size_t point, std::vector<Seen>* all) const {
    all->clear();
    for (uint32_t o = problem_.first_observation[point]; o < problem_.first_observation[point + 1];
         ++o) {
      const BundleObservation& observation = problem_.observations[o];
      const Pinhole& camera = problem_.cameras[observation.image];
      const Rigid3& pose = problem_.cams_from_world[observation.image];
      const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
      const Eigen::Vector3d rotated = rotation * problem_.points[point],
                            x_cam = rotated + pose.translation;
      Matrix23d by_cam;
      const Eigen::Vector2d error = ReprojectionError(camera, x_cam, observation.x_px, &by_cam);
      if (by_cam.isZero(0)) continue;
      const double scale = options_.loss_scale_px;
      const double root = std::sqrt(PointWeight(problem_, point, options_));
      const double weight = root / (1 + error.squaredNorm() / (scale * scale));
      Seen& seen = all->emplace_back();
      seen.image = observation.image;
      seen.x_px = observation.x_px;
      seen.by_point = weight * by_cam * rotation;
      for (int k = 0; k < 3; ++k)  // omega x rotated
        seen.by_pose.col(k) = weight * by_cam * Eigen::Vector3d::Unit(k).cross(rotated);
      seen.by_pose.rightCols<3>() = weight * by_cam;
      seen.by_log_focal = weight * Eigen::Vector2d(camera.fx * x_cam.x() / x_cam.z(),
                                                   camera.fy * x_cam.y() / x_cam.z());
      seen.error = root * error;
    }
  }

  // False where what is seen of a point does not determine it.
  static bool InvertPoint(std::span<const Seen> all, Eigen::Matrix3d* inverse) {
    if (all.size() < 2) return false;
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
    for (const Seen& seen : all) own += seen.by_point.transpose() * seen.by_point;
    bool is_invertible = false;
    own.computeInverseWithCheck(*inverse, is_invertible, 0);
    return is_invertible && inverse->allFinite();
  }

  bool IsFree(uint32_t image) const { return image < problem_.free_count; }
  static Eigen::Index Row(uint32_t image) { return 6 * static_cast<Eigen::Index>(image); }

  // What all points leave when they are eliminated: of the poses, of how these and the focal
  // lengths hang together [poses x lenses], and of the focal lengths.
  struct Sums {
    CameraSystem system;
    Eigen::MatrixXd right, lenses;
  };

  void Eliminate(std::span<const Seen> all, const Eigen::Matrix3d& inverse, Sums* sums) const {
    for (const Seen& a : all) {
      const auto own_lens = lens_of_[a.image];
      const Eigen::RowVector3d by_lens = a.by_log_focal.transpose() * a.by_point * inverse;
      if (own_lens) sums->lenses(*own_lens, *own_lens) += a.by_log_focal.squaredNorm();
      for (const Seen& b : all) {
        const auto lens = lens_of_[b.image];
        if (own_lens && lens)
          sums->lenses(*own_lens, *lens) -= by_lens * (b.by_point.transpose() * b.by_log_focal);
      }
      if (IsFree(a.image)) EliminateForPose(a, all, inverse, sums);
    }
  }

  void EliminateForPose(const Seen& a, std::span<const Seen> all, const Eigen::Matrix3d& inverse,
                        Sums* sums) const {
    const Matrix6d own = a.by_pose.transpose() * a.by_pose;
    sums->system.blocks[pattern_.Diagonal(a.image)] += own;
    sums->system.diagonal.segment<6>(Row(a.image)) += own.diagonal();
    if (const auto lens = lens_of_[a.image])
      sums->right.block<6, 1>(Row(a.image), *lens) -= a.by_pose.transpose() * a.by_log_focal;
    const Eigen::Matrix<double, 6, 3> by_inverse = a.by_pose.transpose() * a.by_point * inverse;
    for (const Seen& b : all) {
      if (const auto lens = lens_of_[b.image]) {
        sums->right.block<6, 1>(Row(a.image), *lens) +=
            by_inverse * (b.by_point.transpose() * b.by_log_focal);
      }
      if (b.image > a.image) continue;
      const size_t block = pattern_.Find(a.image, pattern_.RowBegin(a.image), b.image);
      sums->system.blocks[block] -= by_inverse * (b.by_point.transpose() * b.by_pose);
    }
  }

  // The sum of s s' over the cells of the pictures, where s is the derivative of the cost by the
  // focal lengths when poses and points follow.
  Eigen::MatrixXd SpreadOfScores(const Eigen::MatrixXd& follow) const {
    std::map<Cell, Eigen::VectorXd> scores;
    for (size_t point = 0; point < problem_.points.size(); ++point)
      AddScores(point, follow, &scores);
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(lens_count_, lens_count_);
    for (const auto& [cell, score] : scores) spread += score * score.transpose();
    return spread;
  }

  void AddScores(size_t point, const Eigen::MatrixXd& follow,
                 std::map<Cell, Eigen::VectorXd>* scores) const {
    std::vector<Seen> all;
    Look(point, &all);
    Eigen::Matrix3d inverse;
    if (!InvertPoint(all, &inverse)) return;
    std::vector<Eigen::Matrix2Xd> by_lens;
    Eigen::Matrix3Xd pull = Eigen::Matrix3Xd::Zero(3, lens_count_);
    for (const Seen& seen : all) {
      Eigen::Matrix2Xd& own = by_lens.emplace_back(Eigen::Matrix2Xd::Zero(2, lens_count_));
      if (IsFree(seen.image)) own = seen.by_pose * follow.middleRows<6>(Row(seen.image));
      if (const auto lens = lens_of_[seen.image]) own.col(*lens) += seen.by_log_focal;
      pull += seen.by_point.transpose() * own;
    }
    const Eigen::Matrix3Xd move = inverse * pull;
    // The point takes three of the numbers observed, and the errors are so much smaller for that.
    const double observed = 2 * static_cast<double>(all.size());
    const double leave_out = observed / (observed - 3);
    for (size_t i = 0; i < all.size(); ++i) {
      const Eigen::Matrix2Xd left = by_lens[i] - all[i].by_point * move;
      scores->try_emplace(CellOf(all[i]), Eigen::VectorXd::Zero(lens_count_)).first->second +=
          leave_out * left.transpose() * all[i].error;
    }
  }

  Cell CellOf(const Seen& seen) const {
    // The principal point is near the middle.
    const double side_px = std::max(1.0, problem_.cameras[seen.image].cx * 2 / kCellsAcross);
    return {int64_t{seen.image}, static_cast<int64_t>(std::floor(seen.x_px.x() / side_px)),
            static_cast<int64_t>(std::floor(seen.x_px.y() / side_px))};
  }

  const BundleOptions& options_;
  const std::span<const std::optional<uint32_t>> lens_of_;
  const uint32_t lens_count_;
  const BundleProblem& problem_;
  const BlockPattern pattern_;
};

}  // namespace

std::vector<double> LensDeviations(const BundleOptions& options,
                                   std::span<const std::optional<uint32_t>> lens_of,
                                   uint32_t lens_count, const BundleProblem& problem) {
  if (lens_count == 0 || problem.free_count == 0) return std::vector<double>(lens_count, 0.0);
  return Network(options, lens_of, lens_count, problem).Deviations();
}

}  // namespace veduta
