// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/focal_scan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// How well a geometry of the pair explains its matches: 1 for each without an error, 0 for one at
// the bound and beyond (MSAC; Torr and Zisserman 2000). A mere number of inliers hardly changes
// near the right focal length.
double Explains(const CenteredMatches& pair, double focal_px, uint64_t seed,
                const TwoViewOptions& options) {
  std::vector<Eigen::Vector2d> a, b;
  for (const Eigen::Vector2d& x : pair.a) a.push_back(x / focal_px);
  for (const Eigen::Vector2d& x : pair.b) b.push_back(x / focal_px);
  const TwoViewGeometry geometry = EstimateTwoView(a, b, focal_px, seed, options);
  // What has not moved tells nothing.
  if (geometry.outcome != TwoViewOutcome::kVerified || geometry.geometry == PairGeometry::kRotation)
    return 0;
  const Eigen::Matrix3d essential = EssentialFromPose(geometry.b_from_a);
  double sum = 0;
  for (const uint32_t i : geometry.inliers) {
    const double share = SampsonDistance(essential, a[i], b[i]) * focal_px / options.error_px_max;
    sum += std::max(0.0, 1 - share * share);
  }
  return sum;
}

}  // namespace

Status FocalScanOptions::Check() const {
  return OptionBounds()
      .FiniteAbove("share_min", share_min, 0)
      .FiniteAbove("share_max", share_max, share_min)
      .AtLeast("count", count, 2)
      .Part("two_view", two_view.Check())
      .status();
}

std::vector<double> RankFocalLengths(std::span<const CenteredMatches> pairs, double side_px,
                                     const FocalScanOptions& options, ThreadPool* pool) {
  std::vector<double> focals;
  const double step = std::log(options.share_max / options.share_min) / (options.count - 1);
  for (uint32_t i = 0; i < options.count; ++i)
    focals.push_back(side_px * options.share_min * std::exp(step * i));
  std::vector<double> explained(focals.size() * pairs.size());
  pool->ParallelFor(explained.size(), [&](size_t i) {
    const size_t pair = i % pairs.size();
    explained[i] = Explains(pairs[pair], focals[i / pairs.size()], pair, options.two_view);
  });
  std::vector<std::pair<double, double>> ranked;
  for (size_t f = 0; f < focals.size(); ++f) {
    double sum = 0;
    for (size_t pair = 0; pair < pairs.size(); ++pair) sum += explained[f * pairs.size() + pair];
    if (sum > 0) ranked.emplace_back(sum, focals[f]);
  }
  std::ranges::stable_sort(ranked, [](const auto& x, const auto& y) { return x.first > y.first; });
  std::vector<double> best;
  for (const auto& [sum, focal_px] : ranked) best.push_back(focal_px);
  return best;
}

}  // namespace veduta
