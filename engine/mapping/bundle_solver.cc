// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_solver.h"

#include <Eigen/LU>
#include <algorithm>
#include <functional>
#include <utility>

#include "engine/mapping/camera_system.h"

namespace veduta {
namespace {

// The points are worked on in pieces, whose number depends on the problem alone, so that sums do
// not depend on the number of threads. All three limits were chosen by hand and not measured:
// pieces at most, points in a piece at least, bytes that the pieces' sums take at most.
constexpr size_t kPieces = 8;
constexpr size_t kPointsOfAPiece = 64;
constexpr size_t kBytesOfPieces = 128 << 20;
// The radius of trust: where it starts, and its bounds. Ceres's defaults.
constexpr double kRadiusStart = 1e4, kRadiusMax = 1e16, kRadiusMin = 1e-32;

using Matrix63d = Eigen::Matrix<double, 6, 3>;
// One point's coupling with each free pose that sees it; poses ascend.
using Couplings = std::vector<std::pair<uint32_t, Matrix63d>>;

// A pose as it is used: rotation matrix, and the camera of its image.
struct Projector {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  Pinhole camera;
};

// One observation at the current estimate.
struct Term {
  Eigen::Vector3d rotated;  // R X
  Matrix23d by_cam;         // derivative of the error by the point in the camera frame
  Eigen::Vector2d error;    // px
  double weight;            // the point's, times rho'
};

// One point's normal equations: the inverse with damping, and without damping the gradient and the
// diagonal, by which the quality of a step is judged.
struct PointSystem {
  Eigen::Matrix3d inverse;
  Eigen::Vector3d gradient, diagonal;
};

// The derivative by the tangent of a pose from that by the point in the camera frame: the transpose
// of [-[R X]x | I], times a 3-vector or a 3x3 matrix.
template <typename Derived>
Eigen::Matrix<double, 6, Derived::ColsAtCompileTime> ByPose(
    const Eigen::Vector3d& rotated, const Eigen::MatrixBase<Derived>& by_cam) {
  Eigen::Matrix<double, 6, Derived::ColsAtCompileTime> by_pose;
  for (Eigen::Index k = 0; k < by_cam.cols(); ++k) {
    by_pose.col(k).template head<3>() = rotated.cross(Eigen::Vector3d(by_cam.col(k)));
    by_pose.col(k).template tail<3>() = by_cam.col(k);
  }
  return by_pose;
}

class Solver {
 public:
  Solver(const BundleOptions& options, ThreadPool* pool, BundleProblem* problem)
      : options_(options),
        pool_(pool),
        problem_(*problem),
        pattern_(*problem),
        system_solver_(pattern_, problem->free_count <= options.dense_images_max) {
    const size_t points = problem_.points.size();
    const size_t affordable =
        std::max<size_t>(kBytesOfPieces / (pattern_.block_count() * sizeof(Matrix6d) + 1), 1);
    piece_count_ = std::min(std::clamp<size_t>(points / kPointsOfAPiece, 1, kPieces), affordable);
    pieces_.resize(piece_count_);
    costs_.resize(piece_count_);
    systems_.resize(points);
  }

  BundleSolution Solve() {
    BundleSolution solution;
    Project(problem_.cams_from_world, &projectors_);
    double cost = solution.initial_cost = solution.final_cost = Cost(projectors_, problem_.points);
    if (!std::isfinite(cost)) return solution;
    solution.is_usable = true;
    double radius = kRadiusStart, shrink = 2;
    std::vector<Rigid3> poses;
    std::vector<Eigen::Vector3d> points;
    std::vector<Projector> projectors;
    while (solution.iterations < options_.iterations_max && radius > kRadiusMin) {
      ++solution.iterations;
      double predicted = 0, next = 0;
      const bool is_solved = Step(1 / radius, &poses, &points, &predicted);
      if (is_solved) {
        Project(poses, &projectors);
        next = Cost(projectors, points);
      }
      if (!is_solved || !(next < cost) || !(predicted > 0)) {
        if (is_solved && std::abs(next - cost) <= options_.function_tolerance * cost) break;
        radius /= shrink;
        shrink *= 2;
        continue;
      }
      problem_.cams_from_world.swap(poses);
      problem_.points.swap(points);
      projectors_.swap(projectors);
      const double fall = cost - next, gain = fall / predicted;
      radius = std::min(kRadiusMax, radius / std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)));
      shrink = 2;
      solution.final_cost = next;
      if (fall <= options_.function_tolerance * cost) break;
      cost = next;
    }
    return solution;
  }

 private:
  void ForPieces(const std::function<void(size_t piece, size_t begin, size_t end)>& body) const {
    const size_t n = problem_.points.size();
    const auto run = [&](size_t piece) {
      body(piece, n * piece / piece_count_, n * (piece + 1) / piece_count_);
    };
    if (pool_ != nullptr) {
      pool_->ParallelFor(piece_count_, run);
    } else {
      for (size_t piece = 0; piece < piece_count_; ++piece) run(piece);
    }
  }

  void Project(const std::vector<Rigid3>& poses, std::vector<Projector>* projectors) const {
    projectors->clear();
    for (size_t i = 0; i < poses.size(); ++i) {
      projectors->push_back(
          {poses[i].rotation.toRotationMatrix(), poses[i].translation, problem_.cameras[i]});
    }
  }

  double Cost(const std::vector<Projector>& projectors,
              const std::vector<Eigen::Vector3d>& points) {
    const double square = options_.loss_scale_px * options_.loss_scale_px;
    ForPieces([&](size_t piece, size_t begin, size_t end) {
      double sum = 0;
      for (size_t i = begin; i < end; ++i) {
        double of_point = 0;
        for (uint32_t o = problem_.first_observation[i]; o < problem_.first_observation[i + 1];
             ++o) {
          const BundleObservation& seen = problem_.observations[o];
          const Projector& p = projectors[seen.image];
          of_point += std::log1p(ReprojectionError(p.camera, p.rotation * points[i] + p.translation,
                                                   seen.x_px, nullptr)
                                     .squaredNorm() /
                                 square);
        }
        sum += PointWeight(problem_, i, options_) * of_point;
      }
      costs_[piece] = sum;
    });
    double sum = 0;
    for (const double cost : costs_) sum += cost;
    return 0.5 * square * sum;
  }

  Term Linearize(const BundleObservation& seen, size_t point) const {
    const Projector& p = projectors_[seen.image];
    Term term;
    term.rotated = p.rotation * problem_.points[point];
    term.error = ReprojectionError(p.camera, term.rotated + p.translation, seen.x_px, &term.by_cam);
    const double scale = options_.loss_scale_px;
    term.weight =
        PointWeight(problem_, point, options_) / (1 + term.error.squaredNorm() / (scale * scale));
    return term;
  }

  // Adds one point's equations to the sum of its piece, with the point eliminated at damping
  // `lambda`.
  void Eliminate(size_t point, double lambda, Couplings* couplings, CameraSystem* sum) {
    couplings->clear();
    PointSystem& system = systems_[point];
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    system.gradient.setZero();
    for (uint32_t o = problem_.first_observation[point]; o < problem_.first_observation[point + 1];
         ++o) {
      const BundleObservation& seen = problem_.observations[o];
      const Term term = Linearize(seen, point);
      const Eigen::Matrix3d& rotation = projectors_[seen.image].rotation;
      const Eigen::Matrix3d by_cam = term.weight * term.by_cam.transpose() * term.by_cam;
      const Eigen::Vector3d pull = term.weight * (term.by_cam.transpose() * term.error);
      const Eigen::Matrix3d half = by_cam * rotation;
      hessian.noalias() += rotation.transpose() * half;
      system.gradient.noalias() += rotation.transpose() * pull;
      if (seen.image >= problem_.free_count) continue;
      const Eigen::Matrix<double, 3, 6> left =
          ByPose(term.rotated, by_cam).transpose();  // by_cam is symmetric
      const Matrix6d own = ByPose(term.rotated, left);
      const Eigen::Index at = 6 * static_cast<Eigen::Index>(seen.image);
      sum->blocks[pattern_.Diagonal(seen.image)] += own;
      sum->diagonal.segment<6>(at) += own.diagonal();
      sum->gradient.segment<6>(at) += ByPose(term.rotated, pull);
      couplings->emplace_back(seen.image, ByPose(term.rotated, half));
    }
    system.diagonal = hessian.diagonal();
    hessian.diagonal() *= 1 + lambda;
    bool is_invertible = false;
    hessian.computeInverseWithCheck(system.inverse, is_invertible, 0);
    if (!is_invertible || !system.inverse.allFinite())
      system.inverse.setZero();  // the point stays where it is
    for (size_t i = 0; i < couplings->size(); ++i) {
      const auto& [row, coupling] = (*couplings)[i];
      const Matrix63d eliminated = coupling * system.inverse;
      sum->right.segment<6>(6 * static_cast<Eigen::Index>(row)).noalias() +=
          eliminated * system.gradient;
      size_t block = pattern_.RowBegin(row);
      for (size_t j = 0; j <= i; ++j) {
        block = pattern_.Find(row, block, (*couplings)[j].first);
        sum->blocks[block].noalias() -= eliminated * (*couplings)[j].second.transpose();
      }
    }
  }

  // A damped Gauss-Newton step from the current estimate, and the fall of the cost that its linear
  // model predicts. False if the reduced system is not positive definite.
  bool Step(double lambda, std::vector<Rigid3>* poses, std::vector<Eigen::Vector3d>* points,
            double* predicted) {
    ForPieces([&](size_t piece, size_t begin, size_t end) {
      pieces_[piece].SetZero(pattern_);
      Couplings couplings;
      for (size_t i = begin; i < end; ++i) Eliminate(i, lambda, &couplings, &pieces_[piece]);
    });
    CameraSystem& whole = pieces_.front();
    for (size_t piece = 1; piece < piece_count_; ++piece) whole.Add(pieces_[piece]);
    const auto solved = system_solver_.Solve(whole, lambda);
    if (!solved) return false;
    const Eigen::VectorXd& tangent = *solved;
    *poses = problem_.cams_from_world;
    for (uint32_t i = 0; i < problem_.free_count; ++i)
      (*poses)[i] = MovePose((*poses)[i], tangent.segment<6>(6 * i));
    points->resize(problem_.points.size());
    ForPieces([&](size_t piece, size_t begin, size_t end) {
      costs_[piece] = 0;
      for (size_t i = begin; i < end; ++i) {
        const Eigen::Vector3d move = MovePoint(i, tangent);
        (*points)[i] = problem_.points[i] + move;
        costs_[piece] += Predicted(lambda, systems_[i].diagonal, systems_[i].gradient, move);
      }
    });
    *predicted = Predicted(lambda, whole.diagonal, whole.gradient, tangent);
    for (const double fall : costs_) *predicted += fall;
    return true;
  }

  // The point's part of the step, from the poses' part.
  Eigen::Vector3d MovePoint(size_t point, const Eigen::VectorXd& tangent) const {
    Eigen::Vector3d pull = systems_[point].gradient;
    for (uint32_t o = problem_.first_observation[point]; o < problem_.first_observation[point + 1];
         ++o) {
      const BundleObservation& seen = problem_.observations[o];
      if (seen.image >= problem_.free_count) continue;
      const Term term = Linearize(seen, point);
      const auto move = tangent.segment<6>(6 * static_cast<Eigen::Index>(seen.image));
      const Eigen::Vector3d move_cam =
          Eigen::Vector3d(move.head<3>()).cross(term.rotated) + move.tail<3>();
      const Eigen::Vector2d change = term.by_cam * move_cam;
      pull += projectors_[seen.image].rotation.transpose() *
              (term.weight * (term.by_cam.transpose() * change));
    }
    return -(systems_[point].inverse * pull);
  }

  // With (H + lambda D) step = -gradient, the model -step' gradient - step' H step / 2 becomes
  // this.
  template <typename Vector, typename Move>
  static double Predicted(double lambda, const Vector& diagonal, const Vector& gradient,
                          const Move& step) {
    return 0.5 * step.dot(lambda * diagonal.cwiseProduct(step) - gradient);
  }

  const BundleOptions& options_;
  ThreadPool* pool_;
  BundleProblem& problem_;
  const BlockPattern pattern_;
  SystemSolver system_solver_;
  size_t piece_count_ = 1;
  std::vector<Projector> projectors_;
  std::vector<PointSystem> systems_;  // one for each point
  std::vector<CameraSystem> pieces_;
  std::vector<double> costs_;  // one for each piece
};

}  // namespace

BundleSolution SolveBundle(const BundleOptions& options, ThreadPool* pool, BundleProblem* problem) {
  return Solver(options, pool, problem).Solve();
}

}  // namespace veduta
