// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/submap_relaxation.h"

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "engine/mapping/bundle_problem.h"
#include "engine/mapping/triangulation.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Degrees of freedom of a similarity: turn, move, and the logarithm of the scale.
constexpr int kFreedom = 7;
using Vector7d = Eigen::Matrix<double, kFreedom, 1>;
using Matrix7d = Eigen::Matrix<double, kFreedom, kFreedom>;
using Matrix73d = Eigen::Matrix<double, kFreedom, 3>;
using Matrix27d = Eigen::Matrix<double, 2, kFreedom>;

// The damping, where it starts and where it ends. A long chain of submaps bends by errors that are
// tiny against what holds each of them to its neighbours, so it starts far below that of a bundle
// adjustment (1e-4), which would hold such a bend. Chosen by hand; not measured.
constexpr double kDampingStart = 1e-9, kDampingMax = 1e16, kDampingMin = 1e-16;
// Features are not found more exactly than to a tenth of a pixel. Chosen by hand; not measured.
constexpr double kVarianceMin_px2 = 0.01;
// A step that lowers the cost by a smaller share is the last. Chosen by hand; not measured.
constexpr double kToleranceOfCost = 1e-5;
// Where more of the views are off by so many times the scale of the loss, something may lie far off
// that a coarse loss would join. Chosen by hand; not measured.
constexpr double kFarScales = 4, kFarShareMin = 0.005;
// The scale of a submap is held where the cameras that see its ties lie closer together than such a
// share of the distance to the nearest place that they see: nothing says then how large it is. A
// relaxation that would still change a scale by more than such a factor is not believed. Both were
// chosen by hand and not measured.
constexpr double kSpreadShareMin = 1e-3, kScaleFactorMax = 2;

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// What is estimated.
struct Estimate {
  std::vector<Sim3> new_from_old;
  std::vector<Eigen::Vector3d> centers;  // about which the submaps turn, where they are now
  std::vector<Eigen::Vector3d> places;   // one for each tie
};

// The camera of a view: x_cam = rotation * (x - center), up to the scale of the submap, which a
// projection does not show.
struct PlacedView {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d center;
};

// The normal equations of the submaps, with the places eliminated. Rows below the first submap,
// which is held; blocks of the lower triangle.
struct ReducedSystem {
  std::map<std::pair<uint32_t, uint32_t>, Matrix7d> blocks;
  Eigen::VectorXd right, gradient, diagonal;
};

// One tie's equations: its place, and how each submap that sees it is coupled with it.
struct TieSystem {
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  std::map<uint32_t, Matrix73d> couplings;
};

class Relaxer {
 public:
  Relaxer(const RelaxationProblem& problem, Estimate start)
      : problem_(problem), estimate_(std::move(start)) {
    for (const TieView& view : problem.views)
      given_.push_back(
          {view.cam_from_world.rotation.toRotationMatrix(), view.cam_from_world.Center()});
    HoldScales();
  }

  // Levenberg-Marquardt at one scale of the loss. Where `moves` is false only the places move.
  void Minimise(double scale_px, uint32_t iterations_max, bool moves) {
    scale_px_ = scale_px;
    moves_ = moves;
    double cost = CostOf(estimate_), damping = kDampingStart, growth = 2;
    for (uint32_t i = 0; i < iterations_max && damping < kDampingMax; ++i) {
      const std::optional<Estimate> next = Step(damping);
      const double next_cost = next ? CostOf(*next) : cost;
      if (!next || !(next_cost < cost)) {
        damping *= growth;
        growth *= 2;
        continue;
      }
      estimate_ = *next;
      damping = std::max(kDampingMin, damping / 3);
      growth = 2;
      const bool is_done = cost - next_cost <= kToleranceOfCost * cost;
      cost = next_cost;
      if (is_done) break;
    }
  }

  double CostAt(double scale_px) {
    scale_px_ = scale_px;
    return CostOf(estimate_);
  }

  const Estimate& estimate() const { return estimate_; }

  // The error of each view.
  std::vector<Eigen::Vector2d> Errors() const {
    const std::vector<PlacedView> placed = PlaceViews(estimate_);
    std::vector<Eigen::Vector2d> errors;
    for (size_t tie = 0; tie < estimate_.places.size(); ++tie) {
      for (uint32_t v = problem_.first_view[tie]; v < problem_.first_view[tie + 1]; ++v)
        errors.push_back(ErrorOf(v, placed[v], estimate_.places[tie], nullptr));
    }
    return errors;
  }

 private:
  void HoldScales() {
    std::vector<double> spread(problem_.centers.size()), nearest(spread.size(), INFINITY);
    std::vector<const Eigen::Vector3d*> first(spread.size());  // the first camera of each submap
    for (size_t tie = 0; tie < estimate_.places.size(); ++tie) {
      for (uint32_t v = problem_.first_view[tie]; v < problem_.first_view[tie + 1]; ++v) {
        const uint32_t submap = problem_.views[v].submap;
        const Eigen::Vector3d& center = given_[v].center;
        if (first[submap] == nullptr) first[submap] = &center;
        spread[submap] = std::max(spread[submap], (center - *first[submap]).norm());
        nearest[submap] = std::min(nearest[submap], (center - estimate_.places[tie]).norm());
      }
    }
    for (size_t i = 0; i < spread.size(); ++i)
      holds_scale_.push_back(!(spread[i] > kSpreadShareMin * nearest[i]));
  }

  std::vector<PlacedView> PlaceViews(const Estimate& estimate) const {
    std::vector<Eigen::Matrix3d> turns;
    for (const Sim3& motion : estimate.new_from_old)
      turns.push_back(motion.rotation.toRotationMatrix());
    std::vector<PlacedView> placed(given_.size());
    for (size_t v = 0; v < given_.size(); ++v) {
      const uint32_t submap = problem_.views[v].submap;
      const Sim3& motion = estimate.new_from_old[submap];
      placed[v].rotation.noalias() = given_[v].rotation * turns[submap].transpose();
      placed[v].center = motion.scale * (turns[submap] * given_[v].center) + motion.translation;
    }
    return placed;
  }

  Eigen::Vector2d ErrorOf(uint32_t view, const PlacedView& placed, const Eigen::Vector3d& place,
                          Matrix23d* derivative) const {
    const TieView& seen = problem_.views[view];
    const Eigen::Vector3d x_cam = placed.rotation * (place - placed.center);
    return ReprojectionError(seen.camera, x_cam, seen.x_px, derivative);
  }

  double CostOf(const Estimate& estimate) const {
    const std::vector<PlacedView> placed = PlaceViews(estimate);
    const double square = scale_px_ * scale_px_;
    double sum = 0;
    for (size_t tie = 0; tie < estimate.places.size(); ++tie) {
      for (uint32_t v = problem_.first_view[tie]; v < problem_.first_view[tie + 1]; ++v)
        sum +=
            std::log1p(ErrorOf(v, placed[v], estimate.places[tie], nullptr).squaredNorm() / square);
    }
    return 0.5 * square * sum;
  }

  // Adds what the tie's views say: of the place to `tie`, of the submaps to `sum`.
  void AddViews(size_t tie, const std::vector<PlacedView>& placed, TieSystem* system,
                ReducedSystem* sum) const {
    const Eigen::Vector3d& place = estimate_.places[tie];
    for (uint32_t v = problem_.first_view[tie]; v < problem_.first_view[tie + 1]; ++v) {
      const uint32_t submap = problem_.views[v].submap;
      Matrix23d by_cam;
      const Eigen::Vector2d error = ErrorOf(v, placed[v], place, &by_cam);
      const double weight = 1 / (1 + error.squaredNorm() / (scale_px_ * scale_px_));
      const Matrix23d by_place = by_cam * placed[v].rotation;
      system->hessian += weight * by_place.transpose() * by_place;
      system->gradient += weight * by_place.transpose() * error;
      if (!moves_ || submap == 0) continue;
      // A submap that turns by w about c, moves by t and grows by exp(l) carries a camera at C to
      // where a place x is at R (x - C) + R ((x - c) x w - t - l (C - c)), to first order.
      const Eigen::Vector3d& center = estimate_.centers[submap];
      Matrix27d by_submap;
      by_submap << by_place * CrossMatrix(place - center), -by_place,
          -by_place * (placed[v].center - center);
      if (holds_scale_[submap]) by_submap.col(6).setZero();
      const Matrix7d own = weight * by_submap.transpose() * by_submap;
      const Eigen::Index at = kFreedom * static_cast<Eigen::Index>(submap - 1);
      sum->blocks.try_emplace({submap, submap}, Matrix7d::Zero()).first->second += own;
      sum->diagonal.segment<kFreedom>(at) += own.diagonal();
      sum->gradient.segment<kFreedom>(at) += weight * by_submap.transpose() * error;
      system->couplings.try_emplace(submap, Matrix73d::Zero()).first->second +=
          weight * by_submap.transpose() * by_place;
    }
  }

  // Takes the place out of the submaps' equations; returns the inverse of its own.
  static Eigen::Matrix3d Eliminate(const TieSystem& tie, double damping, ReducedSystem* sum) {
    Eigen::Matrix3d damped = tie.hessian, inverse;
    damped.diagonal() *= 1 + damping;
    bool is_invertible = false;
    damped.computeInverseWithCheck(inverse, is_invertible, 0);
    if (!is_invertible || !inverse.allFinite()) inverse.setZero();  // the place stays where it is
    for (const auto& [row, coupling] : tie.couplings) {
      const Matrix73d eliminated = coupling * inverse;
      sum->right.segment<kFreedom>(kFreedom * static_cast<Eigen::Index>(row - 1)) +=
          eliminated * tie.gradient;
      for (const auto& [column, other] : tie.couplings) {
        if (column > row) break;
        sum->blocks.try_emplace({row, column}, Matrix7d::Zero()).first->second -=
            eliminated * other.transpose();
      }
    }
    return inverse;
  }

  // The submaps' step; nothing where the system is not positive definite.
  static std::optional<Eigen::VectorXd> Solve(const ReducedSystem& system, double damping) {
    std::vector<Eigen::Triplet<double>> entries;
    for (const auto& [place, block] : system.blocks) {
      for (int r = 0; r < kFreedom; ++r) {
        for (int c = 0; c < kFreedom; ++c) {
          const int row = kFreedom * static_cast<int>(place.first - 1) + r;
          const int column = kFreedom * static_cast<int>(place.second - 1) + c;
          if (row >= column) entries.emplace_back(row, column, block(r, c));
        }
      }
    }
    // A submap that shares no place with another gets an equation of its own, and stays.
    for (int i = 0; i < static_cast<int>(system.diagonal.size()); ++i) {
      const double own = system.diagonal[i];
      entries.emplace_back(i, i, own > 0 ? damping * own : 1.0);
    }
    Eigen::SparseMatrix<double> matrix(system.diagonal.size(), system.diagonal.size());
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) return std::nullopt;
    Eigen::VectorXd step = factor.solve(system.right - system.gradient);
    return step.allFinite() ? std::optional(std::move(step)) : std::nullopt;
  }

  // A damped Gauss-Newton step from the estimate.
  std::optional<Estimate> Step(double damping) const {
    const std::vector<PlacedView> placed = PlaceViews(estimate_);
    const Eigen::Index unknowns = moves_ ? kFreedom * (problem_.centers.size() - 1) : 0;
    ReducedSystem sum;
    sum.right = sum.gradient = sum.diagonal = Eigen::VectorXd::Zero(unknowns);
    std::vector<TieSystem> ties(estimate_.places.size());
    std::vector<Eigen::Matrix3d> inverses;
    for (size_t tie = 0; tie < ties.size(); ++tie) {
      AddViews(tie, placed, &ties[tie], &sum);
      inverses.push_back(Eliminate(ties[tie], damping, &sum));
    }
    Estimate next = estimate_;
    Eigen::VectorXd tangent = Eigen::VectorXd::Zero(unknowns);
    if (unknowns > 0) {
      const std::optional<Eigen::VectorXd> solved = Solve(sum, damping);
      if (!solved) return std::nullopt;
      tangent = *solved;
    }
    for (size_t tie = 0; tie < ties.size(); ++tie) {
      Eigen::Vector3d pull = ties[tie].gradient;
      for (const auto& [submap, coupling] : ties[tie].couplings)
        pull += coupling.transpose() *
                tangent.segment<kFreedom>(kFreedom * static_cast<Eigen::Index>(submap - 1));
      next.places[tie] -= inverses[tie] * pull;
    }
    for (Eigen::Index at = 0; at < unknowns; at += kFreedom)
      Move(static_cast<size_t>(at / kFreedom) + 1, tangent.segment<kFreedom>(at), &next);
    return next;
  }

  static void Move(size_t submap, const Vector7d& by, Estimate* estimate) {
    const Eigen::Vector3d omega = by.head<3>(), center = estimate->centers[submap];
    Sim3 motion{std::exp(by[6]), Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};
    if (omega.norm() > 0)
      motion.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm(), omega.normalized()));
    motion.translation = center + by.segment<3>(3) - motion * center;
    estimate->new_from_old[submap] = motion * estimate->new_from_old[submap];
    estimate->centers[submap] = motion * center;
  }

  const RelaxationProblem& problem_;
  std::vector<PlacedView> given_;  // where nothing has moved
  Estimate estimate_;
  std::vector<bool> holds_scale_;  // of each submap
  double scale_px_ = 1;
  bool moves_ = true;
};

// The ties whose places can be found by what sees them, all at once or, where that fails, from one
// submap: the others then say by how much they are off.
std::optional<Eigen::Vector3d> FindPlace(std::span<const TieView> views) {
  const auto triangulate = [&](std::optional<uint32_t> submap) {
    std::vector<Sighting> sightings;
    for (const TieView& view : views) {
      if (!submap || view.submap == *submap)
        sightings.push_back({view.cam_from_world, view.camera, view.x_px});
    }
    return sightings.size() < 2 ? std::nullopt : Triangulate(sightings);
  };
  std::optional<Eigen::Vector3d> place = triangulate(std::nullopt);
  for (size_t v = 0; v < views.size() && !place; ++v) place = triangulate(views[v].submap);
  return place;
}

// Whether many views are far off.
bool IsFar(const Relaxer& relaxer, double loss_scale_px) {
  const std::vector<Eigen::Vector2d> errors = relaxer.Errors();
  const auto far = std::ranges::count_if(
      errors, [&](const Eigen::Vector2d& e) { return e.norm() > kFarScales * loss_scale_px; });
  return static_cast<double>(far) > kFarShareMin * static_cast<double>(errors.size());
}

// The problem with the ties that have a place, and an estimate of it where nothing has moved.
std::pair<RelaxationProblem, Estimate> Begin(const RelaxationProblem& problem) {
  RelaxationProblem begun;
  begun.centers = problem.centers;
  Estimate start{std::vector<Sim3>(problem.centers.size()), problem.centers, {}};
  for (size_t tie = 0; tie + 1 < problem.first_view.size(); ++tie) {
    const uint32_t begin = problem.first_view[tie], end = problem.first_view[tie + 1];
    const auto views = std::span(problem.views).subspan(begin, end - begin);
    const std::optional<Eigen::Vector3d> place = FindPlace(views);
    if (!place) continue;
    start.places.push_back(*place);
    begun.views.insert(begun.views.end(), views.begin(), views.end());
    begun.first_view.push_back(static_cast<uint32_t>(begun.views.size()));
  }
  return {std::move(begun), std::move(start)};
}

std::vector<double> ListChanges(const RelaxationProblem& problem,
                                const std::vector<Eigen::Vector2d>& before,
                                const std::vector<Eigen::Vector2d>& after) {
  std::vector<std::vector<double>> changes(problem.centers.size());
  for (size_t v = 0; v < problem.views.size(); ++v)
    changes[problem.views[v].submap].push_back((after[v] - before[v]).norm());
  std::vector<double> medians;
  for (std::vector<double>& of_one : changes) medians.push_back(MedianOf(std::move(of_one)));
  return medians;
}

}  // namespace

Status RelaxationOptions::Check() const {
  return OptionBounds()
      .Above("loss_scale_px", loss_scale_px, 0)
      .AtLeast("coarse_scale_px", coarse_scale_px, loss_scale_px)
      .AtLeast("iterations_max", iterations_max, 1)
      .AtLeast("gain_sigmas_min", gain_sigmas_min, 0)
      .status();
}

Result<Relaxation> RelaxSubmaps(const RelaxationProblem& given, const RelaxationOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  const auto [problem, start] = Begin(given);
  Relaxation relaxation;
  if (problem.centers.size() < 2 || problem.views.empty()) return relaxation;
  Relaxer still(problem, start);
  still.Minimise(options.loss_scale_px, options.iterations_max, false);
  relaxation.initial_cost = still.CostAt(options.loss_scale_px);
  Relaxer near(problem, still.estimate()), far(problem, start);
  near.Minimise(options.loss_scale_px, options.iterations_max, true);
  if (IsFar(near, options.loss_scale_px)) {
    for (double scale = options.coarse_scale_px; scale > options.loss_scale_px; scale /= 4)
      far.Minimise(scale, options.iterations_max, true);
    far.Minimise(options.loss_scale_px, options.iterations_max, true);
  }
  const double near_cost = near.CostAt(options.loss_scale_px);
  const double far_cost = far.CostAt(options.loss_scale_px);
  const Relaxer& best = far_cost < near_cost ? far : near;
  relaxation.cost = std::min(near_cost, far_cost);
  const double unknowns = kFreedom * static_cast<double>(problem.centers.size() - 1);
  const double freedom = 2.0 * static_cast<double>(problem.views.size()) -
                         3.0 * static_cast<double>(start.places.size()) - unknowns;
  if (!(freedom > 0)) return relaxation;
  const double variance = std::max(kVarianceMin_px2, 2 * relaxation.cost / freedom);
  relaxation.is_significant =
      2 * (relaxation.initial_cost - relaxation.cost) >
      variance * (unknowns + options.gain_sigmas_min * std::sqrt(2 * unknowns));
  relaxation.new_from_old = best.estimate().new_from_old;
  for (const Sim3& motion : relaxation.new_from_old) {
    if (!(motion.scale <= kScaleFactorMax && motion.scale * kScaleFactorMax >= 1))
      relaxation.is_significant = false;
  }
  relaxation.change_px = ListChanges(problem, still.Errors(), best.Errors());
  return relaxation;
}

}  // namespace veduta
