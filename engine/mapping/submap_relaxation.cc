// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/submap_relaxation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "engine/mapping/submap_bodies.h"
#include "engine/mapping/submap_relaxer.h"
#include "engine/mapping/triangulation.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Degrees of freedom of a similarity.
constexpr int kFreedom = 7;
// Features are not found more exactly than to a tenth of a pixel. Chosen by hand; not measured.
constexpr double kVarianceMin_px2 = 0.01;
// Errors of features side by side are not independent, and what is left of an error after a fit is
// less than it: the variance that it tells is taken for so many times as much. In a ring of eight
// submaps with errors of 1.5 px it was 1.8 times too small. Chosen by hand.
constexpr double kVarianceFactor = 2;
// Where more of the views are off by so many times the scale of the loss, something may lie far off
// that a coarse loss would join. Chosen by hand; not measured.
constexpr double kFarScales = 4, kFarShareMin = 0.005;
// A relaxation that would change a scale by more than such a factor is not believed. Chosen by
// hand; not measured.
constexpr double kScaleFactorMax = 2;

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

// What a solver ended with.
struct Solution {
  RelaxationEstimate estimate;
  std::vector<Eigen::Vector2d> errors;  // of each view
  double cost = 0;                      // at the last scale
  bool is_carried = false;
};

// Minimises at one scale after the other.
Solution Solve(const RelaxationProblem& problem, const RelaxationEstimate& start, bool moves,
               std::span<const double> scales_px, uint32_t iterations_max, ThreadPool* pool) {
  SubmapRelaxer relaxer(problem, start, pool);
  for (const double scale : scales_px) relaxer.Minimise(scale, iterations_max, moves);
  return {relaxer.estimate(), relaxer.Errors(), relaxer.CostAt(scales_px.back())};
}

// By how much, for each unknown, errors of measurement alone lower twice the cost. Of an
// M-estimator that is the mean of psi^2 over the mean of its derivative (Huber, "Robust
// Statistics", 1981, section 7.6); psi of the Cauchy loss is w e with the weight w, and the trace
// of its derivative is 2 w^2. What is far off hardly counts.
double VarianceOf(std::span<const Eigen::Vector2d> errors, double scale_px) {
  double squares = 0, derivatives = 0;
  for (const Eigen::Vector2d& error : errors) {
    const double weight = 1 / (1 + error.squaredNorm() / (scale_px * scale_px));
    squares += weight * weight * error.squaredNorm();
    derivatives += 2 * weight * weight;
  }
  return squares / derivatives;
}

// Whether many views are far off.
bool IsFar(const Solution& solution, double loss_scale_px) {
  const auto far = std::ranges::count_if(solution.errors, [&](const Eigen::Vector2d& e) {
    return e.norm() > kFarScales * loss_scale_px;
  });
  return static_cast<double>(far) > kFarShareMin * static_cast<double>(solution.errors.size());
}

// The problem with the ties that have a place, and an estimate of it where nothing has moved.
std::pair<RelaxationProblem, RelaxationEstimate> Begin(const RelaxationProblem& problem) {
  RelaxationProblem begun;
  begun.centers = problem.centers;
  begun.pairs = problem.pairs;
  RelaxationEstimate start{std::vector<Sim3>(problem.centers.size()), problem.centers, {}};
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

// The estimate with the submaps carried to where they belong as bodies, and each place where it is
// seen from there; nothing where all stay.
std::optional<RelaxationEstimate> Carry(const RelaxationProblem& problem,
                                        const RelaxationEstimate& from, ThreadPool* pool) {
  RelaxationEstimate carried{CarryBodies(problem, pool), from.centers, from.places};
  if (carried.new_from_old.empty()) return std::nullopt;
  for (size_t i = 0; i < carried.centers.size(); ++i)
    carried.centers[i] = carried.new_from_old[i] * carried.centers[i];
  for (size_t tie = 0; tie < carried.places.size(); ++tie) {
    std::vector<TieView> views;
    for (uint32_t v = problem.first_view[tie]; v < problem.first_view[tie + 1]; ++v) {
      TieView& view = views.emplace_back(problem.views[v]);
      view.cam_from_world =
          TransformCameraWorld(carried.new_from_old[view.submap], view.cam_from_world);
    }
    carried.places[tie] = FindPlace(views).value_or(carried.places[tie]);
  }
  return carried;
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

// The solution of least cost of those that are worth trying, from where nothing has moved.
Solution FindBest(const RelaxationProblem& problem, const RelaxationEstimate& start,
                  const RelaxationEstimate& near, const RelaxationOptions& options,
                  ThreadPool* pool) {
  const auto solve = [&](const RelaxationEstimate& from, std::span<const double> scales_px) {
    return Solve(problem, from, true, scales_px, options.iterations_max, pool);
  };
  const std::vector<double> fine = {options.loss_scale_px};
  Solution best = solve(near, fine);
  const auto consider = [&](Solution solution) {
    if (solution.cost < best.cost) best = std::move(solution);
  };
  if (!IsFar(best, options.loss_scale_px)) return best;
  if (const std::optional<RelaxationEstimate> carried = Carry(problem, start, pool)) {
    Solution solution = solve(*carried, fine);
    solution.is_carried = true;
    consider(std::move(solution));
  }
  if (!IsFar(best, options.loss_scale_px)) return best;
  std::vector<double> coarse;
  for (double scale = options.coarse_scale_px; scale > options.loss_scale_px; scale /= 4)
    coarse.push_back(scale);
  coarse.push_back(options.loss_scale_px);
  consider(solve(start, coarse));
  return best;
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

Result<Relaxation> RelaxSubmaps(const RelaxationProblem& given, const RelaxationOptions& options,
                                ThreadPool* pool) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  const auto [problem, start] = Begin(given);
  Relaxation relaxation;
  if (problem.centers.size() < 2 || problem.views.empty()) return relaxation;
  const double scales_px[] = {options.loss_scale_px};
  const Solution still = Solve(problem, start, false, scales_px, options.iterations_max, pool);
  const Solution best = FindBest(problem, start, still.estimate, options, pool);
  relaxation.initial_cost = still.cost;
  relaxation.cost = best.cost;
  relaxation.is_carried = best.is_carried;
  const double unknowns = kFreedom * static_cast<double>(problem.centers.size() - 1);
  const double freedom = 2.0 * static_cast<double>(problem.views.size()) -
                         3.0 * static_cast<double>(start.places.size()) - unknowns;
  if (!(freedom > 0)) return relaxation;
  const double share_free = freedom / (2.0 * static_cast<double>(problem.views.size()));
  const double variance =
      std::max(kVarianceMin_px2,
               kVarianceFactor * VarianceOf(best.errors, options.loss_scale_px) / share_free);
  relaxation.is_significant =
      2 * (relaxation.initial_cost - relaxation.cost) >
      variance * (unknowns + options.gain_sigmas_min * std::sqrt(2 * unknowns));
  relaxation.new_from_old = best.estimate.new_from_old;
  for (const Sim3& motion : relaxation.new_from_old) {
    if (!(motion.scale <= kScaleFactorMax && motion.scale * kScaleFactorMax >= 1))
      relaxation.is_significant = false;
  }
  relaxation.change_px = ListChanges(problem, still.errors, best.errors);
  return relaxation;
}

}  // namespace veduta
