// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/exposure.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "fusion/surface/color_view.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr double kConverged = 1e-6;  // change of a log gain
constexpr size_t kTripletsMax =
    1u << 22;  // summed into the matrix before more are gathered: bounds the memory
constexpr uint32_t kKnown = ~0u;  // an image that is no unknown

using Light = Eigen::Vector3d;  // log, a channel each

struct Seen {
  uint32_t image;  // index
  Light light;
};

struct Problem {
  std::vector<ImageId> images;  // ascending
  std::vector<Seen> seen;       // those of a point stand together
  std::vector<size_t> first;    // of each point, and the end
  std::vector<Light> gains;     // of each image
  std::vector<uint8_t> is_fixed;

  size_t point_count() const { return first.size() - 1; }
};

// Observations that say something, in an order that does not depend on the caller's; one for each
// photo and point.
std::vector<ColorObservation> Useful(std::span<const ColorObservation> observations,
                                     const ExposureOptions& options) {
  std::vector<ColorObservation> useful;
  for (const ColorObservation& o : observations) {
    const auto [low, high] = std::minmax_element(o.rgb.begin(), o.rgb.end());
    if (*low >= options.dark && *high <= options.bright) useful.push_back(o);
  }
  const auto key = [](const ColorObservation& o) { return std::tie(o.point, o.image, o.rgb); };
  std::sort(useful.begin(), useful.end(),
            [&](const auto& a, const auto& b) { return key(a) < key(b); });
  const auto same = [](const auto& a, const auto& b) {
    return a.point == b.point && a.image == b.image;
  };
  useful.erase(std::unique(useful.begin(), useful.end(), same), useful.end());
  return useful;
}

// Keeps points of two photos or more, and drops photos that have too few of them, until both hold.
std::vector<ColorObservation> Shared(std::vector<ColorObservation> list,
                                     const std::map<ImageId, Eigen::Vector3f>& fixed,
                                     const ExposureOptions& options) {
  for (;;) {
    std::vector<ColorObservation> kept;
    std::map<ImageId, uint32_t> counts;
    for (size_t i = 0; i < list.size();) {
      size_t end = i;
      while (end < list.size() && list[end].point == list[i].point) ++end;
      const size_t used = std::min<size_t>(end - i, options.views_per_point_max);
      for (size_t k = i; used >= 2 && k < i + used; ++k)
        kept.push_back(list[k]), ++counts[list[k].image];
      i = end;
    }
    const auto is_poor = [&](const ColorObservation& o) {
      return counts[o.image] < options.observations_min && fixed.count(o.image) == 0;
    };
    const size_t before = kept.size();
    kept.erase(std::remove_if(kept.begin(), kept.end(), is_poor), kept.end());
    list = std::move(kept);
    if (list.size() == before) return list;
  }
}

Problem Pose(const std::vector<ColorObservation>& shared,
             const std::map<ImageId, Eigen::Vector3f>& fixed) {
  Problem problem;
  for (const ColorObservation& o : shared) problem.images.push_back(o.image);
  std::sort(problem.images.begin(), problem.images.end());
  problem.images.erase(std::unique(problem.images.begin(), problem.images.end()),
                       problem.images.end());
  for (const ImageId image : problem.images) {
    const auto it = fixed.find(image);
    problem.is_fixed.push_back(it != fixed.end());
    problem.gains.push_back(it != fixed.end() ? Light(it->second.cast<double>().array().log())
                                              : Light::Zero());
  }
  for (size_t i = 0; i < shared.size(); ++i) {
    if (i == 0 || shared[i].point != shared[i - 1].point) problem.first.push_back(i);
    const auto at = std::lower_bound(problem.images.begin(), problem.images.end(), shared[i].image);
    Light light;
    for (int c = 0; c < 3; ++c)
      light[c] = std::log(static_cast<double>(LightFromSrgb(shared[i].rgb[c])));
    problem.seen.push_back({static_cast<uint32_t>(at - problem.images.begin()), light});
  }
  problem.first.push_back(shared.size());
  return problem;
}

// The least image of each image's connected group; of a group with fixed images, the least fixed
// one.
std::vector<uint32_t> Groups(const Problem& problem) {
  std::vector<uint32_t> parent(problem.images.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto stands_first = [&](uint32_t a, uint32_t b) {
    return problem.is_fixed[a] != problem.is_fixed[b] ? problem.is_fixed[a] > problem.is_fixed[b]
                                                      : a < b;
  };
  for (size_t p = 0; p < problem.point_count(); ++p) {
    for (size_t k = problem.first[p] + 1; k < problem.first[p + 1]; ++k) {
      const uint32_t a = root(problem.seen[k - 1].image), b = root(problem.seen[k].image);
      if (a != b) (stands_first(a, b) ? parent[b] : parent[a]) = stands_first(a, b) ? a : b;
    }
  }
  for (uint32_t i = 0; i < parent.size(); ++i) parent[i] = root(i);
  return parent;
}

// The point's log light as the photos see it with their gains, and the weights' sum.
std::pair<Light, double> PointLight(const Problem& problem, const std::vector<double>& weights,
                                    size_t p) {
  Light sum = Light::Zero();
  double total = 0;
  for (size_t k = problem.first[p]; k < problem.first[p + 1]; ++k) {
    sum += weights[k] * (problem.seen[k].light + problem.gains[problem.seen[k].image]);
    total += weights[k];
  }
  return {sum / total, total};
}

// One weighted least-squares step; returns the largest change of a log gain, or a negative number
// where the matrix is singular. `unknown`: each image's row.
double Step(const std::vector<double>& weights, const std::vector<uint32_t>& unknown, uint32_t rows,
            bool per_channel, Problem* problem) {
  Eigen::SparseMatrix<double> matrix(rows, rows);
  Eigen::Matrix<double, Eigen::Dynamic, 3> residual = Eigen::MatrixX3d::Zero(rows, 3);
  std::vector<Eigen::Triplet<double>> triplets;
  const auto flush = [&] {
    Eigen::SparseMatrix<double> part(rows, rows);
    part.setFromTriplets(triplets.begin(), triplets.end());
    matrix += part;
    triplets.clear();
  };
  for (size_t p = 0; p < problem->point_count(); ++p) {
    const auto [mean, total] = PointLight(*problem, weights, p);
    for (size_t k = problem->first[p]; k < problem->first[p + 1]; ++k) {
      const Seen& a = problem->seen[k];
      if (unknown[a.image] == kKnown) continue;
      residual.row(unknown[a.image]) +=
          weights[k] * (mean - a.light - problem->gains[a.image]).transpose();
      for (size_t m = problem->first[p]; m < problem->first[p + 1]; ++m) {
        const uint32_t column = unknown[problem->seen[m].image];
        if (column == kKnown) continue;
        triplets.emplace_back(unknown[a.image], column,
                              weights[k] * ((k == m ? 1 : 0) - weights[m] / total));
      }
    }
    if (triplets.size() > kTripletsMax) flush();
  }
  flush();
  if (!per_channel) residual = residual.rowwise().mean().replicate(1, 3).eval();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  if (solver.info() != Eigen::Success) return -1;
  const Eigen::Matrix<double, Eigen::Dynamic, 3> change = solver.solve(residual);
  if (!change.allFinite()) return -1;
  for (size_t i = 0; i < problem->images.size(); ++i) {
    if (unknown[i] != kKnown) problem->gains[i] += change.row(unknown[i]).transpose();
  }
  return change.cwiseAbs().maxCoeff();
}

void Reweigh(const Problem& problem, double scale, std::vector<double>* weights) {
  const std::vector<double> before = *weights;
  for (size_t p = 0; p < problem.point_count(); ++p) {
    const Light mean = PointLight(problem, before, p).first;
    for (size_t k = problem.first[p]; k < problem.first[p + 1]; ++k) {
      const Light r = problem.seen[k].light + problem.gains[problem.seen[k].image] - mean;
      (*weights)[k] = 1 / (1 + r.squaredNorm() / (3 * scale * scale));
    }
  }
}

// Groups that no fixed gain holds get a mean log gain of 0.
void Center(const std::vector<uint32_t>& group, Problem* problem) {
  std::map<uint32_t, std::pair<Light, double>> sums;
  for (size_t i = 0; i < group.size(); ++i) {
    auto& [sum, count] = sums.try_emplace(group[i], Light::Zero(), 0).first->second;
    sum += problem->gains[i];
    ++count;
  }
  for (size_t i = 0; i < group.size(); ++i) {
    if (problem->is_fixed[group[i]]) continue;
    const auto& [sum, count] = sums[group[i]];
    problem->gains[i] -= sum / count;
  }
}

Status SolveGains(const ExposureOptions& options, Problem* problem) {
  const std::vector<uint32_t> group = Groups(*problem);
  std::vector<uint32_t> unknown(problem->images.size(), kKnown);
  uint32_t rows = 0;
  for (uint32_t i = 0; i < unknown.size(); ++i) {
    if (!problem->is_fixed[i] && group[i] != i) unknown[i] = rows++;
  }
  if (rows == 0) return {};
  std::vector<double> weights(problem->seen.size(), 1.0);
  for (uint32_t iteration = 0; iteration < options.iterations_max; ++iteration) {
    const double change = Step(weights, unknown, rows, options.per_channel, problem);
    if (change < 0)
      return Status::InvalidArgument(
          "exposures cannot be solved for: their equations are singular");
    if (change < kConverged && iteration > 0) break;
    Reweigh(*problem, options.residual_scale, &weights);
  }
  Center(group, problem);
  return {};
}

}  // namespace

Status ExposureOptions::Check() const {
  return OptionBounds()
      .AboveUpTo("residual_scale", residual_scale, 0, 10)
      .AtLeast("iterations_max", iterations_max, 1)
      .AtLeast("observations_min", observations_min, 1)
      .Between("views_per_point_max", views_per_point_max, 2, 1000)
      .AtLeast("dark", dark, 1)
      .Above("bright", bright, dark)
      .status();
}

Result<std::map<ImageId, Eigen::Vector3f>> SolveExposures(
    std::span<const ColorObservation> observations, const std::map<ImageId, Eigen::Vector3f>& fixed,
    const ExposureOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  for (const auto& [image, gain] : fixed) {
    if (!gain.allFinite() || gain.minCoeff() <= 0) {
      return Status::InvalidArgument("the fixed gain of image " + std::to_string(image.value) +
                                     " is not finite and positive");
    }
  }
  std::map<ImageId, Eigen::Vector3f> gains = fixed;
  for (const ColorObservation& o : observations)
    gains.try_emplace(o.image, Eigen::Vector3f::Ones());
  const std::vector<ColorObservation> shared =
      Shared(Useful(observations, options), fixed, options);
  if (shared.empty()) return gains;
  Problem problem = Pose(shared, fixed);
  VEDUTA_RETURN_IF_ERROR(SolveGains(options, &problem));
  for (size_t i = 0; i < problem.images.size(); ++i) {
    if (problem.is_fixed[i]) continue;
    gains[problem.images[i]] = problem.gains[i].array().exp().cast<float>();
  }
  return gains;
}

}  // namespace veduta
