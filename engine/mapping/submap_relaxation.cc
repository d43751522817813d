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
// Ties of each two submaps that are never left out, so that none loses its hold. Chosen by hand.
constexpr size_t kTiesMin = 4;
// Where more of the views are off by so many times the scale of the loss, something may lie far off
// that a coarse loss would join. Chosen by hand; not measured.
constexpr double kFarScales = 4, kFarShareMin = 0.005;
// A relaxation that would change a scale by more than such a factor is not believed. Chosen by
// hand; not measured.
constexpr double kScaleFactorMax = 2;
// A solution is another one where it costs less than this share of the first; else it is the same
// minimum, but for rounding. Chosen by hand; not measured.
constexpr double kOtherCostShareMax = 0.99;

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
  bool is_far = false;                  // sought far from where the submaps stand
};

// Minimises at one scale after the other.
Solution Solve(const RelaxationProblem& problem, const RelaxationEstimate& start, bool moves,
               std::span<const double> scales_px, uint32_t iterations_max, ThreadPool* pool) {
  SubmapRelaxer relaxer(problem, start, pool);
  for (const double scale : scales_px) relaxer.Minimise(scale, iterations_max, moves);
  return {relaxer.estimate(), relaxer.Errors(), relaxer.CostAt(scales_px.back())};
}

// Whether many views are far off.
bool IsFar(const Solution& solution, double loss_scale_px) {
  const auto far = std::ranges::count_if(solution.errors, [&](const Eigen::Vector2d& e) {
    return e.norm() > kFarScales * loss_scale_px;
  });
  return static_cast<double>(far) > kFarShareMin * static_cast<double>(solution.errors.size());
}

// The problem with every so many-th tie, so that some `views_max` views are left, and more where
// each two submaps would lose their hold. Ties of two submaps that follow each other belong
// together.
RelaxationProblem TakeSome(const RelaxationProblem& problem, size_t views_max) {
  RelaxationProblem some{problem.centers, {0}, {}, problem.pairs};
  const size_t step = std::max<size_t>(1, (problem.views.size() + views_max - 1) / views_max);
  std::pair<uint32_t, uint32_t> last;
  size_t count = 0;  // of ties of the two submaps
  for (size_t tie = 0; tie + 1 < problem.first_view.size(); ++tie) {
    const auto begin = problem.views.begin() + problem.first_view[tie],
               end = problem.views.begin() + problem.first_view[tie + 1];
    const auto [least, most] = std::minmax_element(
        begin, end, [](const TieView& x, const TieView& y) { return x.submap < y.submap; });
    const std::pair<uint32_t, uint32_t> both(least->submap, most->submap);
    count = both == last ? count + 1 : 0;
    last = both;
    if (count >= kTiesMin && count % step != 0) continue;
    some.views.insert(some.views.end(), begin, end);
    some.first_view.push_back(static_cast<uint32_t>(some.views.size()));
  }
  return some;
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

// The estimate where submaps stand as `new_from_old` says, and each place where it is seen from
// there; where nothing tells, as in `from`.
RelaxationEstimate StandAt(const RelaxationProblem& problem, const RelaxationEstimate& from,
                           const std::vector<Sim3>& new_from_old) {
  RelaxationEstimate there{new_from_old, problem.centers, from.places};
  for (size_t i = 0; i < there.centers.size(); ++i)
    there.centers[i] = new_from_old[i] * there.centers[i];
  for (size_t tie = 0; tie < there.places.size(); ++tie) {
    std::vector<TieView> views;
    for (uint32_t v = problem.first_view[tie]; v < problem.first_view[tie + 1]; ++v) {
      TieView& view = views.emplace_back(problem.views[v]);
      view.cam_from_world = TransformCameraWorld(new_from_old[view.submap], view.cam_from_world);
    }
    there.places[tie] = FindPlace(views).value_or(there.places[tie]);
  }
  return there;
}

// Whether a scale changes by no more than may be believed.
bool IsBelievable(const Sim3& motion) {
  return motion.scale <= kScaleFactorMax && motion.scale * kScaleFactorMax >= 1;
}

bool IsBelievable(const Solution& solution) {
  return std::ranges::all_of(solution.estimate.new_from_old,
                             [](const Sim3& motion) { return IsBelievable(motion); });
}

// The problem without the ties that see a submap whose scale is not believed.
RelaxationProblem WithoutWild(const RelaxationProblem& problem, const Solution& solution) {
  RelaxationProblem rest{problem.centers, {0}, {}, problem.pairs};
  for (size_t tie = 0; tie + 1 < problem.first_view.size(); ++tie) {
    const auto begin = problem.views.begin() + problem.first_view[tie],
               end = problem.views.begin() + problem.first_view[tie + 1];
    const bool is_held = std::all_of(begin, end, [&](const TieView& view) {
      return IsBelievable(solution.estimate.new_from_old[view.submap]);
    });
    if (!is_held) continue;
    rest.views.insert(rest.views.end(), begin, end);
    rest.first_view.push_back(static_cast<uint32_t>(rest.views.size()));
  }
  return rest;
}

// Seeks a solution that is far from where the submaps stand, with `carried` bodies (none where it
// is empty) and from a coarse loss. It is sought by some of the ties. What is `near` is begun from
// once more, with each place where it is seen from there: that alone may lead far away.
Solution SeekFar(const RelaxationProblem& all, const std::vector<Sim3>& near,
                 const std::vector<Sim3>& carried, const RelaxationOptions& options,
                 ThreadPool* pool) {
  const auto begun = Begin(TakeSome(all, options.sought_by_views_max));
  const RelaxationProblem& problem = begun.first;
  const RelaxationEstimate& start = begun.second;
  const auto solve = [&](const RelaxationEstimate& from, std::span<const double> scales_px) {
    return Solve(problem, from, true, scales_px, options.iterations_max, pool);
  };
  const std::vector<double> fine = {options.loss_scale_px};
  Solution best = solve(StandAt(problem, start, near), fine);
  const auto consider = [&](Solution solution) {
    const bool is_better = solution.cost < best.cost || !IsBelievable(best);
    if (is_better && IsBelievable(solution)) best = std::move(solution);
  };
  if (!carried.empty()) consider(solve(StandAt(problem, start, carried), fine));
  std::vector<double> coarse;
  for (double scale = options.coarse_scale_px; scale > options.loss_scale_px; scale /= 4)
    coarse.push_back(scale);
  coarse.push_back(options.loss_scale_px);
  consider(solve(start, coarse));
  return best;
}

// The solution of least cost of those that are worth trying, from where nothing has moved.
Solution FindBest(const RelaxationProblem& problem, const RelaxationEstimate& start,
                  const RelaxationEstimate& still, const RelaxationOptions& options,
                  ThreadPool* pool) {
  const double fine[] = {options.loss_scale_px};
  const auto solve = [&](const RelaxationEstimate& from) {
    return Solve(problem, from, true, fine, options.iterations_max, pool);
  };
  Solution near = solve(still);
  if (!IsFar(near, options.loss_scale_px)) return near;
  const Solution sought =
      SeekFar(problem, near.estimate.new_from_old, CarryBodies(problem, pool), options, pool);
  Solution far = solve(StandAt(problem, start, sought.estimate.new_from_old));
  far.is_far = far.cost < kOtherCostShareMax * near.cost;
  return far.cost < near.cost && IsBelievable(far) ? far : near;
}

}  // namespace

Status RelaxationOptions::Check() const {
  return OptionBounds()
      .Above("loss_scale_px", loss_scale_px, 0)
      .AtLeast("coarse_scale_px", coarse_scale_px, loss_scale_px)
      .AtLeast("iterations_max", iterations_max, 1)
      .AtLeast("gain_sigmas_min", gain_sigmas_min, 0)
      .AtLeast("views_max", views_max, 1)
      .Between("sought_by_views_max", sought_by_views_max, 1, views_max)
      .status();
}

namespace {

// Once more without the submaps that cannot be believed, where `may_leave_out`.
Relaxation Relax(const RelaxationProblem& given, const RelaxationOptions& options,
                 bool may_leave_out, ThreadPool* pool) {
  const auto begun = Begin(TakeSome(given, options.views_max));
  const RelaxationProblem& problem = begun.first;
  const RelaxationEstimate& start = begun.second;
  Relaxation relaxation;
  if (problem.centers.size() < 2 || problem.views.empty()) return relaxation;
  const double scales_px[] = {options.loss_scale_px};
  const Solution still = Solve(problem, start, false, scales_px, options.iterations_max, pool);
  const Solution best = FindBest(problem, start, still.estimate, options, pool);
  if (may_leave_out && !IsBelievable(best))
    return Relax(WithoutWild(given, best), options, false, pool);
  relaxation.initial_cost = still.cost;
  relaxation.cost = best.cost;
  relaxation.is_far = best.is_far;
  const double unknowns = kFreedom * static_cast<double>(problem.centers.size() - 1);
  const double freedom = 2.0 * static_cast<double>(problem.views.size()) -
                         3.0 * static_cast<double>(start.places.size()) - unknowns;
  if (!(freedom > 0)) return relaxation;
  const double variance = std::max(kVarianceMin_px2, 2 * relaxation.cost / freedom);
  relaxation.is_significant =
      IsBelievable(best) &&
      2 * (relaxation.initial_cost - relaxation.cost) >
          variance * (unknowns + options.gain_sigmas_min * std::sqrt(2 * unknowns));
  relaxation.new_from_old = best.estimate.new_from_old;
  relaxation.change_px = ListChanges(problem, still.errors, best.errors);
  relaxation.is_tied.resize(problem.centers.size());
  for (const TieView& view : problem.views) relaxation.is_tied[view.submap] = true;
  return relaxation;
}

}  // namespace

Result<Relaxation> RelaxSubmaps(const RelaxationProblem& problem, const RelaxationOptions& options,
                                ThreadPool* pool) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  return Relax(problem, options, true, pool);
}

}  // namespace veduta
