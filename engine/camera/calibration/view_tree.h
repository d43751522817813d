// SPDX-License-Identifier: Apache-2.0
#pragma once
// Views joined by homographies into a tree: the adjacent views of R3, whose homographies give all
// others as products.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/camera/calibration/planar_views.h"

namespace veduta {

inline constexpr uint32_t kNoView = 0xffffffff;

struct ViewTree {
  uint32_t root = kNoView;
  std::vector<uint32_t> order;  // the views of the tree, parents before children; the root first
  std::vector<uint32_t>
      parent;  // of every view; kNoView for the root and for views outside the tree
  std::vector<Eigen::Matrix3d>
      view_from_parent;  // of every view; identity where there is no parent

  bool Contains(uint32_t view) const { return view == root || parent[view] != kNoView; }
  // Of views in the tree. The product along the path, unit norm.
  Eigen::Matrix3d ViewFromRoot(uint32_t view) const;
};

struct ViewTreeOptions {
  uint32_t common_count_min = 8;    // >= 6: points that two adjacent views share
  uint32_t common_count_full = 30;  // more than these make no pair better
  double error_max = 0.02;  // > 0, in ImageUnits: what lens distortion may bend, 32 px of 1600
};

// Grows a maximum spanning tree of views from the one that shares most points with the others, by
// robust homographies refined to the gold standard. Views that no homography joins to the largest
// tree stay outside. O(views^2 + views * points). Deterministic. Empty if no two views can be
// joined.
ViewTree GrowViewTree(const std::vector<PlanarView>& views, const ViewTreeOptions& options = {});

}  // namespace veduta
