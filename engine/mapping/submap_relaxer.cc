// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/submap_relaxer.h"

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "engine/mapping/bundle_problem.h"
#include "storage/base/cross_matrix.h"

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
// A step that lowers the cost by a smaller share is the last. Chosen by hand; not measured.
constexpr double kToleranceOfCost = 1e-4;
// The scale of a submap is held where the cameras that see its ties lie closer together than such a
// share of the distance to the nearest place that they see: nothing says then how large it is.
// Chosen by hand; not measured.
constexpr double kSpreadShareMin = 1e-3;
// The ties are summed in so many runs, whatever the number of threads, so that the sums are the
// same to the last bit.
constexpr size_t kRuns = 16;
// Of a view whose submap does not move.
constexpr uint32_t kNoSlot = UINT32_MAX;

Eigen::Index RowOf(uint32_t submap) {
  return kFreedom * static_cast<Eigen::Index>(submap - 1);
}

void Move(uint32_t submap, const Vector7d& by, RelaxationEstimate* estimate) {
  const Eigen::Vector3d omega = by.head<3>(), center = estimate->centers[submap];
  Sim3 motion{std::exp(by[6]), Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};
  if (omega.norm() > 0)
    motion.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm(), omega.normalized()));
  motion.translation = center + by.segment<3>(3) - motion * center;
  estimate->new_from_old[submap] = motion * estimate->new_from_old[submap];
  estimate->centers[submap] = motion * center;
}

// The camera of a view: x_cam = rotation * (x - center), up to the scale of the submap, which a
// projection does not show.
struct PlacedCamera {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d center;
};

// What a step of Levenberg-Marquardt works on.
struct Step {
  const RelaxationEstimate& from;
  double scale_px, damping;
  bool moves;                              // whether submaps move
  std::vector<Eigen::Matrix3d> turns;      // of the submaps
  std::vector<Eigen::Matrix3d> inverses;   // of each tie's own damped equations
  std::vector<Eigen::Vector3d> gradients;  // of each tie
  std::vector<Matrix73d> couplings;        // of each slot
};

// The normal equations of the submaps with the places eliminated. Rows below the first submap,
// which is held.
struct ReducedSystem {
  std::vector<Matrix7d> blocks;
  Eigen::VectorXd right, gradient, diagonal;

  ReducedSystem(size_t block_count, Eigen::Index unknowns)
      : blocks(block_count, Matrix7d::Zero()),
        right(Eigen::VectorXd::Zero(unknowns)),
        gradient(right),
        diagonal(right) {}
  void Add(const ReducedSystem& other) {
    for (size_t i = 0; i < blocks.size(); ++i) blocks[i] += other.blocks[i];
    right += other.right, gradient += other.gradient, diagonal += other.diagonal;
  }
};

std::vector<Eigen::Matrix3d> TurnsOf(const RelaxationEstimate& estimate) {
  std::vector<Eigen::Matrix3d> turns;
  for (const Sim3& motion : estimate.new_from_old)
    turns.push_back(motion.rotation.toRotationMatrix());
  return turns;
}

}  // namespace

class SubmapRelaxer::Equations {
 public:
  Equations(const RelaxationProblem& problem, const RelaxationEstimate& start, ThreadPool* pool)
      : problem_(problem), pool_(*pool) {
    for (const TieView& view : problem.views)
      given_.push_back(
          {view.cam_from_world.rotation.toRotationMatrix(), view.cam_from_world.Center()});
    HoldScales(start);
    FindSlots();
    FindBlocks();
  }

  double CostOf(const RelaxationEstimate& estimate, double scale_px) const {
    const std::vector<Eigen::Matrix3d> turns = TurnsOf(estimate);
    const double square = scale_px * scale_px;
    std::vector<double> sums(kRuns);
    pool_.ParallelFor(kRuns, [&](size_t run) {
      ForViews(run, [&](size_t tie, uint32_t v) {
        const PlacedCamera placed = Place(estimate, turns, v);
        sums[run] +=
            std::log1p(ErrorOf(v, placed, estimate.places[tie], nullptr).squaredNorm() / square);
      });
    });
    return 0.5 * square * std::accumulate(sums.begin(), sums.end(), 0.0);
  }

  std::vector<Eigen::Vector2d> ErrorsOf(const RelaxationEstimate& estimate) const {
    const std::vector<Eigen::Matrix3d> turns = TurnsOf(estimate);
    std::vector<Eigen::Vector2d> errors(given_.size());
    for (size_t run = 0; run < kRuns; ++run) {
      ForViews(run, [&](size_t tie, uint32_t v) {
        errors[v] = ErrorOf(v, Place(estimate, turns, v), estimate.places[tie], nullptr);
      });
    }
    return errors;
  }

  // A damped Gauss-Newton step; nothing where the system is not positive definite.
  std::optional<RelaxationEstimate> Next(const RelaxationEstimate& from, double scale_px,
                                         double damping, bool moves) {
    Step step{from, scale_px, damping, moves, TurnsOf(from), {}, {}, {}};
    step.inverses.resize(tie_count());
    step.gradients.resize(tie_count());
    step.couplings.resize(slot_submap_.size(), Matrix73d::Zero());
    const ReducedSystem sum = Reduce(&step);
    RelaxationEstimate next = from;
    Eigen::VectorXd tangent = Eigen::VectorXd::Zero(sum.gradient.size());
    if (moves) {
      const std::optional<Eigen::VectorXd> solved = Solve(sum, damping);
      if (!solved) return std::nullopt;
      tangent = *solved;
    }
    for (size_t tie = 0; tie < tie_count(); ++tie) {
      Eigen::Vector3d pull = step.gradients[tie];
      for (uint32_t slot = first_slot_[tie]; moves && slot < first_slot_[tie + 1]; ++slot)
        pull +=
            step.couplings[slot].transpose() * tangent.segment<kFreedom>(RowOf(slot_submap_[slot]));
      next.places[tie] -= step.inverses[tie] * pull;
    }
    for (uint32_t submap = 1; moves && submap < problem_.centers.size(); ++submap)
      Move(submap, tangent.segment<kFreedom>(RowOf(submap)), &next);
    return next;
  }

 private:
  size_t tie_count() const { return problem_.first_view.size() - 1; }

  // Calls visit(tie, view) for the views of a run's ties, in order.
  void ForViews(size_t run, const auto& visit) const {
    for (size_t tie = run * tie_count() / kRuns; tie < (run + 1) * tie_count() / kRuns; ++tie) {
      for (uint32_t v = problem_.first_view[tie]; v < problem_.first_view[tie + 1]; ++v)
        visit(tie, v);
    }
  }

  void HoldScales(const RelaxationEstimate& start) {
    std::vector<double> spread(problem_.centers.size()), nearest(spread.size(), INFINITY);
    std::vector<std::optional<Eigen::Vector3d>> first(spread.size());  // camera of each submap
    const std::vector<Eigen::Matrix3d> turns = TurnsOf(start);
    for (size_t run = 0; run < kRuns; ++run) {
      ForViews(run, [&](size_t tie, uint32_t v) {
        const uint32_t submap = problem_.views[v].submap;
        const Eigen::Vector3d center = Place(start, turns, v).center;
        if (!first[submap]) first[submap] = center;
        spread[submap] = std::max(spread[submap], (center - *first[submap]).norm());
        nearest[submap] = std::min(nearest[submap], (center - start.places[tie]).norm());
      });
    }
    for (size_t i = 0; i < spread.size(); ++i)
      holds_scale_.push_back(!(spread[i] > kSpreadShareMin * nearest[i]));
  }

  // Finds the submaps that each tie couples.
  void FindSlots() {
    first_slot_ = {0};
    for (size_t tie = 0; tie < tie_count(); ++tie) {
      for (uint32_t v = problem_.first_view[tie]; v < problem_.first_view[tie + 1]; ++v) {
        const uint32_t submap = problem_.views[v].submap;
        const auto begin = slot_submap_.begin() + first_slot_[tie];
        const auto found = std::find(begin, slot_submap_.end(), submap);
        slot_of_view_.push_back(submap == 0 ? kNoSlot
                                            : static_cast<uint32_t>(found - slot_submap_.begin()));
        if (submap != 0 && found == slot_submap_.end()) slot_submap_.push_back(submap);
      }
      first_slot_.push_back(static_cast<uint32_t>(slot_submap_.size()));
    }
  }

  // Finds the blocks of the lower triangle that are not zero, and the one of each two slots.
  void FindBlocks() {
    std::set<std::pair<uint32_t, uint32_t>> places;
    for (uint32_t submap = 1; submap < problem_.centers.size(); ++submap)
      places.insert({submap, submap});
    for (size_t tie = 0; tie < tie_count(); ++tie)
      ForPairs(tie, [&](uint32_t row, uint32_t column) {
        places.insert({slot_submap_[row], slot_submap_[column]});
      });
    block_places_.assign(places.begin(), places.end());
    own_block_.resize(problem_.centers.size());
    for (uint32_t i = 0; i < block_places_.size(); ++i) {
      const auto [row, column] = block_places_[i];
      if (row == column) own_block_[row] = i;
    }
    first_block_ = {0};
    for (size_t tie = 0; tie < tie_count(); ++tie) {
      ForPairs(tie, [&](uint32_t row, uint32_t column) {
        const std::pair<uint32_t, uint32_t> place(slot_submap_[row], slot_submap_[column]);
        block_of_pair_.push_back(static_cast<uint32_t>(
            std::ranges::lower_bound(block_places_, place) - block_places_.begin()));
      });
      first_block_.push_back(static_cast<uint32_t>(block_of_pair_.size()));
    }
  }

  // Calls visit(row, column) for each two slots of the tie whose block is in the lower triangle,
  // the same slot twice among them.
  void ForPairs(size_t tie, const auto& visit) const {
    for (uint32_t row = first_slot_[tie]; row < first_slot_[tie + 1]; ++row) {
      for (uint32_t column = first_slot_[tie]; column < first_slot_[tie + 1]; ++column) {
        if (slot_submap_[column] <= slot_submap_[row]) visit(row, column);
      }
    }
  }

  PlacedCamera Place(const RelaxationEstimate& estimate, const std::vector<Eigen::Matrix3d>& turns,
                     uint32_t view) const {
    const uint32_t submap = problem_.views[view].submap;
    const Sim3& motion = estimate.new_from_old[submap];
    PlacedCamera placed;
    placed.rotation.noalias() = given_[view].rotation * turns[submap].transpose();
    placed.center = motion.scale * (turns[submap] * given_[view].center) + motion.translation;
    return placed;
  }

  Eigen::Vector2d ErrorOf(uint32_t view, const PlacedCamera& placed, const Eigen::Vector3d& place,
                          Matrix23d* derivative) const {
    const TieView& seen = problem_.views[view];
    const Eigen::Vector3d x_cam = placed.rotation * (place - placed.center);
    return ReprojectionError(seen.camera, x_cam, seen.x_px, derivative);
  }

  // Adds up all ties' equations.
  ReducedSystem Reduce(Step* step) const {
    const Eigen::Index unknowns =
        step->moves ? kFreedom * (static_cast<Eigen::Index>(problem_.centers.size()) - 1) : 0;
    const size_t blocks = step->moves ? block_places_.size() : 0;
    std::vector<ReducedSystem> sums(kRuns, ReducedSystem(blocks, unknowns));
    pool_.ParallelFor(kRuns, [&](size_t run) {
      for (size_t tie = run * tie_count() / kRuns; tie < (run + 1) * tie_count() / kRuns; ++tie) {
        const Eigen::Matrix3d hessian = AddViews(tie, step, &sums[run]);
        Eliminate(tie, hessian, step, &sums[run]);
      }
    });
    for (size_t run = 1; run < kRuns; ++run) sums[0].Add(sums[run]);
    return std::move(sums[0]);
  }

  // Adds what the tie's views say: of the place to the step, of the submaps to `sum`. Returns the
  // place's own equations.
  Eigen::Matrix3d AddViews(size_t tie, Step* step, ReducedSystem* sum) const {
    const Eigen::Vector3d& place = step->from.places[tie];
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (uint32_t v = problem_.first_view[tie]; v < problem_.first_view[tie + 1]; ++v) {
      const PlacedCamera placed = Place(step->from, step->turns, v);
      Matrix23d by_cam;
      const Eigen::Vector2d error = ErrorOf(v, placed, place, &by_cam);
      const double weight = 1 / (1 + error.squaredNorm() / (step->scale_px * step->scale_px));
      const Matrix23d by_place = by_cam * placed.rotation;
      const Eigen::Matrix<double, 3, 2> weighted = weight * by_place.transpose();
      hessian.noalias() += weighted * by_place;
      gradient.noalias() += weighted * error;
      const uint32_t slot = slot_of_view_[v];
      if (!step->moves || slot == kNoSlot) continue;
      const uint32_t submap = slot_submap_[slot];
      // A submap that turns by w about c, moves by t and grows by exp(l) carries a camera at C to
      // where a place x is at R (x - C) + R ((x - c) x w - t - l (C - c)), to first order.
      const Eigen::Vector3d& center = step->from.centers[submap];
      Matrix27d by_submap;
      by_submap << by_place * CrossMatrix(place - center), -by_place,
          -by_place * (placed.center - center);
      if (holds_scale_[submap]) by_submap.col(6).setZero();
      const Eigen::Matrix<double, kFreedom, 2> weighted_submap = weight * by_submap.transpose();
      sum->gradient.segment<kFreedom>(RowOf(submap)).noalias() += weighted_submap * error;
      step->couplings[slot].noalias() += weighted_submap * by_place;
      const Matrix7d own = weighted_submap * by_submap;
      sum->diagonal.segment<kFreedom>(RowOf(submap)) += own.diagonal();
      sum->blocks[own_block_[submap]] += own;
    }
    step->gradients[tie] = gradient;
    return hessian;
  }

  // Takes the place out of the submaps' equations.
  void Eliminate(size_t tie, const Eigen::Matrix3d& hessian, Step* step, ReducedSystem* sum) const {
    Eigen::Matrix3d damped = hessian, inverse;
    damped.diagonal() *= 1 + step->damping;
    bool is_invertible = false;
    damped.computeInverseWithCheck(inverse, is_invertible, 0);
    if (!is_invertible || !inverse.allFinite()) inverse.setZero();  // the place stays where it is
    step->inverses[tie] = inverse;
    if (!step->moves) return;
    for (uint32_t slot = first_slot_[tie]; slot < first_slot_[tie + 1]; ++slot)
      sum->right.segment<kFreedom>(RowOf(slot_submap_[slot])) +=
          step->couplings[slot] * (inverse * step->gradients[tie]);
    uint32_t at = first_block_[tie];
    ForPairs(tie, [&](uint32_t row, uint32_t column) {
      const Matrix73d eliminated = step->couplings[row] * inverse;
      sum->blocks[block_of_pair_[at++]].noalias() -=
          eliminated * step->couplings[column].transpose();
    });
  }

  // The submaps' step; nothing where the system is not positive definite.
  std::optional<Eigen::VectorXd> Solve(const ReducedSystem& system, double damping) {
    std::vector<Eigen::Triplet<double>> entries;
    for (size_t i = 0; i < block_places_.size(); ++i) {
      const auto [row_submap, column_submap] = block_places_[i];
      for (int r = 0; r < kFreedom; ++r) {
        for (int c = 0; c < kFreedom; ++c) {
          const Eigen::Index row = RowOf(row_submap) + r, column = RowOf(column_submap) + c;
          if (row >= column)
            entries.emplace_back(static_cast<int>(row), static_cast<int>(column),
                                 system.blocks[i](r, c));
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
    if (!is_analyzed_) factor_.analyzePattern(matrix);
    is_analyzed_ = true;
    factor_.factorize(matrix);
    if (factor_.info() != Eigen::Success || !(factor_.vectorD().minCoeff() > 0))
      return std::nullopt;
    Eigen::VectorXd step = factor_.solve(system.right - system.gradient);
    return step.allFinite() ? std::optional(std::move(step)) : std::nullopt;
  }

  const RelaxationProblem& problem_;
  ThreadPool& pool_;
  std::vector<PlacedCamera> given_;  // where nothing has moved
  std::vector<bool> holds_scale_;    // of each submap
  // Slots are the free submaps that see a tie, each once: those of tie t from first_slot_[t] on.
  std::vector<uint32_t> first_slot_, slot_submap_, slot_of_view_;
  std::vector<std::pair<uint32_t, uint32_t>> block_places_;  // row and column, in submaps
  std::vector<uint32_t> own_block_;                          // of each submap with itself
  std::vector<uint32_t> first_block_, block_of_pair_;        // in the order of ForPairs
  // Its pattern is that of the blocks, and is analysed once.
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  bool is_analyzed_ = false;
};

SubmapRelaxer::SubmapRelaxer(const RelaxationProblem& problem, RelaxationEstimate start,
                             ThreadPool* pool)
    : estimate_(std::move(start)),
      equations_(std::make_unique<Equations>(problem, estimate_, pool)) {}

SubmapRelaxer::~SubmapRelaxer() = default;

void SubmapRelaxer::Minimise(double scale_px, uint32_t iterations_max, bool moves) {
  double cost = CostAt(scale_px), damping = kDampingStart, growth = 2;
  for (uint32_t i = 0; i < iterations_max && damping < kDampingMax; ++i) {
    std::optional<RelaxationEstimate> next = equations_->Next(estimate_, scale_px, damping, moves);
    const double next_cost = next ? equations_->CostOf(*next, scale_px) : cost;
    if (!next || !(next_cost < cost)) {
      damping *= growth;
      growth *= 2;
      continue;
    }
    estimate_ = *std::move(next);
    damping = std::max(kDampingMin, damping / 3);
    growth = 2;
    const bool is_done = cost - next_cost <= kToleranceOfCost * cost;
    cost = next_cost;
    if (is_done) break;
  }
}

double SubmapRelaxer::CostAt(double scale_px) const {
  return equations_->CostOf(estimate_, scale_px);
}

std::vector<Eigen::Vector2d> SubmapRelaxer::Errors() const {
  return equations_->ErrorsOf(estimate_);
}

}  // namespace veduta
