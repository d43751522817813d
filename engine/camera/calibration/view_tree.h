// SPDX-License-Identifier: Apache-2.0
#pragma once
// Views joined by homographies into a tree: the adjacent views of R3, whose homographies give all
// others as products.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/camera/calibration/planar_views.h"
#include "storage/base/status.h"

namespace veduta {

inline constexpr uint32_t kNoView = 0xffffffff;

struct ViewTree {
  uint32_t root = kNoView;
  std::vector<uint32_t> order;  // the views of the tree, parents before children; the root first
  // Of every view; kNoView for the root and for views outside the tree.
  std::vector<uint32_t> parent;
  // Of every view; the identity where there is no parent.
  std::vector<Eigen::Matrix3d> view_from_parent;

  bool Contains(uint32_t view) const { return view == root || parent[view] != kNoView; }
  // For a view in the tree: the product of the homographies along its path, of unit norm.
  Eigen::Matrix3d ViewFromRoot(uint32_t view) const;
};

struct ViewTreeOptions {
  // >= 6; how many points two adjacent views must share. Twice what a homography needs.
  uint32_t common_count_min = 8;
  // >= common_count_min; two pairs that share more than this are equally good. Chosen by hand; not
  // measured.
  uint32_t common_count_full = 30;
  // ImageUnits; > 0. The largest error of a point that fits: what lens distortion may bend, 32 px
  // of 1600. Chosen by hand; not measured.
  double error_max = 0.02;

  Status Check() const;  // the first violated bound, named with its value
};

// Grows a maximum spanning tree of views from the one that shares most points with the others, by
// robust homographies refined to the gold standard. Views that no homography joins to the largest
// tree stay outside. O(views^2 + views * points). Deterministic. Empty if no two views can be
// joined.
ViewTree GrowViewTree(const std::vector<PlanarView>& views, const ViewTreeOptions& options = {});

}  // namespace veduta
