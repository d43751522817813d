// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/view_tree.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "engine/camera/calibration/homography.h"
#include "storage/base/content_hash.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

struct Pairs {
  std::vector<Eigen::Vector2d> a, b;
  std::vector<double> sigma_a, sigma_b;
};

// The gold-standard homography of two views, if enough of their points agree on one.
std::optional<Eigen::Matrix3d> Join(const PlanarView& a, const PlanarView& b,
                                    const ViewTreeOptions& options, uint64_t seed) {
  std::vector<Eigen::Vector2d> x_a, x_b;
  const auto common = CommonPoints(a, b);
  for (const auto& [i, j] : common) x_a.push_back(a[i].x), x_b.push_back(b[j].x);
  const auto robust = EstimateHomography(x_a, x_b, options.error_max, seed);
  if (!robust || robust->inliers.size() < options.common_count_min ||
      2 * robust->inliers.size() < common.size()) {
    return std::nullopt;
  }
  Pairs pairs;
  for (const uint32_t k : robust->inliers) {
    pairs.a.push_back(x_a[k]);
    pairs.b.push_back(x_b[k]);
    pairs.sigma_a.push_back(a[common[k].first].sigma);
    pairs.sigma_b.push_back(b[common[k].second].sigma);
  }
  return RefineHomography(robust->b_from_a, pairs.a, pairs.b, pairs.sigma_a, pairs.sigma_b);
}

// How many points each two views share.
std::vector<std::vector<uint32_t>> CommonCounts(const std::vector<PlanarView>& views) {
  std::vector<std::vector<uint32_t>> counts(views.size(), std::vector<uint32_t>(views.size()));
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      counts[i][j] = counts[j][i] = static_cast<uint32_t>(CommonPoints(views[i], views[j]).size());
    }
  }
  return counts;
}

}  // namespace

Eigen::Matrix3d ViewTree::ViewFromRoot(uint32_t view) const {
  Eigen::Matrix3d product = Eigen::Matrix3d::Identity();
  for (; view != root; view = parent[view]) product = product * view_from_parent[view];
  return product / product.norm();
}

Status ViewTreeOptions::Check() const {
  return OptionBounds()
      .AtLeast("common_count_min", common_count_min, 6)
      .AtLeast("common_count_full", common_count_full, common_count_min)
      .FiniteAbove("error_max", error_max, 0)
      .status();
}

ViewTree GrowViewTree(const std::vector<PlanarView>& views, const ViewTreeOptions& options) {
  const Status status = options.Check();
  VEDUTA_CHECK(status.ok(), status.message());
  const auto n = static_cast<uint32_t>(views.size());
  std::vector<std::vector<uint32_t>> common = CommonCounts(views);
  for (auto& row : common) {
    for (uint32_t& count : row) {
      count = count < options.common_count_min ? 0 : std::min(count, options.common_count_full);
    }
  }
  const auto total = [&](uint32_t v) {
    return std::accumulate(common[v].begin(), common[v].end(), uint64_t{0});
  };
  std::vector<uint32_t> roots(n);
  std::iota(roots.begin(), roots.end(), 0u);
  std::stable_sort(roots.begin(), roots.end(),
                   [&](uint32_t a, uint32_t b) { return total(a) > total(b); });

  ViewTree best;
  std::vector<bool> tried(n, false);
  for (const uint32_t root : roots) {
    if (tried[root]) continue;  // it was reached from a root that shares more
    ViewTree tree;
    tree.root = root;
    tree.order = {root};
    tree.parent.assign(n, kNoView);
    tree.view_from_parent.assign(n, Eigen::Matrix3d::Identity());
    std::vector<std::vector<uint32_t>> weight = common;  // 0 for a pair that was tried
    for (;;) {
      uint32_t parent = kNoView, child = kNoView, most = 0;
      for (const uint32_t p : tree.order) {  // ties go to the view nearest the root
        for (uint32_t c = 0; c < n; ++c) {
          if (!tree.Contains(c) && weight[p][c] > most) most = weight[p][c], parent = p, child = c;
        }
      }
      if (most == 0) break;
      const auto h = Join(views[parent], views[child], options, MixSeed(parent, child));
      weight[parent][child] = 0;
      if (!h) continue;
      tree.parent[child] = parent;
      tree.view_from_parent[child] = *h;
      tree.order.push_back(child);
    }
    for (const uint32_t v : tree.order) tried[v] = true;
    if (tree.order.size() > best.order.size()) best = std::move(tree);
  }
  if (best.order.size() < 2) best = {};
  return best;
}

}  // namespace veduta
