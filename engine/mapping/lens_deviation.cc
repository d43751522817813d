// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/lens_deviation.h"

#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "engine/mapping/camera_system.h"

namespace veduta {
namespace {

// Cells across a picture's width, as in network_covariance.cc.
constexpr double kCellsAcross = 4;
// By this share the diagonal grows, for the scale of the whole is left open: it changes no lens, so
// that it takes no part in what is solved for.
constexpr double kDamping = 1e-8;

using Matrix26d = Eigen::Matrix<double, 2, 6>;
using ByLens = Eigen::Matrix<double, 2, kLensValueCount>;
using Jet = ceres::Jet<double, 3 + kLensValueCount>;
// A part of one image's picture.
using Cell = std::array<int64_t, 3>;

// What one image sees of one point: derivatives of the error by the point by the image's pose and
// by its lens, each times the weight of Cauchy's loss. These and the error are also times the root
// of what the point counts (PointWeight).
struct Seen {
  uint32_t image = 0;
  Matrix23d by_point;
  Matrix26d by_pose;
  ByLens by_lens;
  Eigen::Vector2d error, x_px;
};

// The error of an image with a lens, and its derivatives by the point in the camera frame and by
// LensChange; all 0 behind the camera.
Eigen::Vector2d LensError(const CameraModel& lens, const Eigen::Vector3d& x_cam,
                          const Eigen::Vector2d& x_px, Matrix23d* by_cam, ByLens* by_lens) {
  by_cam->setZero();
  by_lens->setZero();
  if (x_cam.z() < 1e-9) return Eigen::Vector2d::Zero();
  Eigen::Matrix<Jet, 3, 1> point;
  Jet change[kLensValueCount];
  for (int i = 0; i < 3; ++i) point[i] = Jet(x_cam[i], i);
  for (int i = 0; i < kLensValueCount; ++i) change[i] = Jet(0.0, 3 + i);
  const Eigen::Matrix<Jet, 2, 1> seen = ProjectThroughLens(lens, change, point);
  for (int i = 0; i < 2; ++i) {
    by_cam->row(i) = seen[i].v.head<3>();
    by_lens->row(i) = seen[i].v.tail<kLensValueCount>();
  }
  return Eigen::Vector2d(seen[0].a, seen[1].a) - x_px;
}

class Network {
 public:
  Network(const BundleOptions& options, const BundleLenses& lenses, const BundleProblem& problem)
      : options_(options),
        lenses_(lenses),
        value_count_(kLensValueCount * static_cast<Eigen::Index>(lenses.models.size())),
        problem_(problem),
        pattern_(problem) {}

  std::vector<double> Deviations() const {
    const std::vector<double> none(lenses_.models.size(), 0.0);
    Sums sums;
    sums.right.setZero(Row(problem_.free_count), value_count_);
    sums.lenses.setZero(value_count_, value_count_);
    sums.system.SetZero(pattern_);
    std::vector<Seen> all;
    for (size_t point = 0; point < problem_.points.size(); ++point) {
      Look(point, &all);
      Eigen::Matrix3d inverse;
      if (InvertPoint(all, &inverse)) Eliminate(all, inverse, &sums);
    }
    // How poses move when a lens changes and all that is seen is to be explained.
    SystemSolver poses(pattern_, problem_.free_count <= options_.dense_images_max);
    const std::optional<Eigen::MatrixXd> follow = poses.Solve(sums.system, kDamping, sums.right);
    if (!follow) return none;
    Eigen::MatrixXd information = sums.lenses - sums.right.transpose() * *follow;
    const Eigen::VectorXd told = information.diagonal();
    Eigen::MatrixXd spread = SpreadOfScores(*follow);
    for (Eigen::Index i = 0; i < value_count_; ++i) {
      const double sigma = kLensPriorSigmas[i % kLensValueCount];
      information(i, i) += 1 / (sigma * sigma);
      spread(i, i) += 1 / (sigma * sigma);
    }
    const Eigen::LLT<Eigen::MatrixXd> solver(information);
    if (solver.info() != Eigen::Success) return none;
    const Eigen::MatrixXd inverse =
        solver.solve(Eigen::MatrixXd::Identity(value_count_, value_count_));
    const Eigen::MatrixXd covariance = inverse * spread * inverse;
    std::vector<double> deviations = none;
    for (uint32_t lens = 0; lens < deviations.size(); ++lens) {
      const Eigen::Index focal = ColumnOf(lens);
      const double deviation = std::sqrt(covariance(focal, focal));
      if (told[focal] > 0 && std::isfinite(deviation)) deviations[lens] = deviation;
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
      ByLens by_lens = ByLens::Zero();
      const auto lens = lenses_.of_image[observation.image];
      const Eigen::Vector2d error =
          lens ? LensError(lenses_.models[*lens], x_cam, observation.x_px, &by_cam, &by_lens)
               : ReprojectionError(camera, x_cam, observation.x_px, &by_cam);
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
      seen.by_lens = weight * by_lens;
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
  static Eigen::Index ColumnOf(uint32_t lens) {
    return kLensValueCount * static_cast<Eigen::Index>(lens);
  }

  // What all points leave when they are eliminated: of the poses, of how these and the lenses hang
  // together [poses x lenses], and of the lenses.
  struct Sums {
    CameraSystem system;
    Eigen::MatrixXd right, lenses;
  };

  void Eliminate(std::span<const Seen> all, const Eigen::Matrix3d& inverse, Sums* sums) const {
    constexpr int kCount = kLensValueCount;
    for (const Seen& a : all) {
      if (const auto own = lenses_.of_image[a.image]) {
        const Eigen::Matrix<double, kCount, 3> by_inverse =
            a.by_lens.transpose() * a.by_point * inverse;
        sums->lenses.block<kCount, kCount>(ColumnOf(*own), ColumnOf(*own)) +=
            a.by_lens.transpose() * a.by_lens;
        for (const Seen& b : all) {
          const auto lens = lenses_.of_image[b.image];
          if (!lens) continue;
          sums->lenses.block<kCount, kCount>(ColumnOf(*own), ColumnOf(*lens)) -=
              by_inverse * (b.by_point.transpose() * b.by_lens);
        }
      }
      if (IsFree(a.image)) EliminateForPose(a, all, inverse, sums);
    }
  }

  void EliminateForPose(const Seen& a, std::span<const Seen> all, const Eigen::Matrix3d& inverse,
                        Sums* sums) const {
    const Matrix6d own = a.by_pose.transpose() * a.by_pose;
    sums->system.blocks[pattern_.Diagonal(a.image)] += own;
    sums->system.diagonal.segment<6>(Row(a.image)) += own.diagonal();
    const auto add = [&](uint32_t lens, const Eigen::Matrix<double, 6, kLensValueCount>& right) {
      sums->right.block<6, kLensValueCount>(Row(a.image), ColumnOf(lens)) += right;
    };
    if (const auto lens = lenses_.of_image[a.image]) add(*lens, -a.by_pose.transpose() * a.by_lens);
    const Eigen::Matrix<double, 6, 3> by_inverse = a.by_pose.transpose() * a.by_point * inverse;
    for (const Seen& b : all) {
      if (const auto lens = lenses_.of_image[b.image])
        add(*lens, by_inverse * (b.by_point.transpose() * b.by_lens));
      if (b.image > a.image) continue;
      const size_t block = pattern_.Find(a.image, pattern_.RowBegin(a.image), b.image);
      sums->system.blocks[block] -= by_inverse * (b.by_point.transpose() * b.by_pose);
    }
  }

  // The sum of s s' over the cells of the pictures, where s is the derivative of the cost by the
  // lenses when poses and points follow.
  Eigen::MatrixXd SpreadOfScores(const Eigen::MatrixXd& follow) const {
    std::map<Cell, Eigen::VectorXd> scores;
    for (size_t point = 0; point < problem_.points.size(); ++point)
      AddScores(point, follow, &scores);
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(value_count_, value_count_);
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
    Eigen::Matrix3Xd pull = Eigen::Matrix3Xd::Zero(3, value_count_);
    for (const Seen& seen : all) {
      Eigen::Matrix2Xd& own = by_lens.emplace_back(Eigen::Matrix2Xd::Zero(2, value_count_));
      if (IsFree(seen.image)) own = seen.by_pose * follow.middleRows<6>(Row(seen.image));
      if (const auto lens = lenses_.of_image[seen.image])
        own.middleCols<kLensValueCount>(ColumnOf(*lens)) += seen.by_lens;
      pull += seen.by_point.transpose() * own;
    }
    const Eigen::Matrix3Xd move = inverse * pull;
    // The point takes three of the numbers observed, and the errors are so much smaller for that.
    const double observed = 2 * static_cast<double>(all.size());
    const double leave_out = observed / (observed - 3);
    for (size_t i = 0; i < all.size(); ++i) {
      const Eigen::Matrix2Xd left = by_lens[i] - all[i].by_point * move;
      scores->try_emplace(CellOf(all[i]), Eigen::VectorXd::Zero(value_count_)).first->second +=
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
  const BundleLenses& lenses_;
  const Eigen::Index value_count_;
  const BundleProblem& problem_;
  const BlockPattern pattern_;
};

}  // namespace

std::vector<double> LensDeviations(const BundleOptions& options, const BundleLenses& lenses,
                                   const BundleProblem& problem) {
  if (lenses.models.empty() || problem.free_count == 0)
    return std::vector<double>(lenses.models.size(), 0.0);
  return Network(options, lenses, problem).Deviations();
}

}  // namespace veduta
