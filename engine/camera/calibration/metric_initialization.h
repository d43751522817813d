// SPDX-License-Identifier: Apache-2.0
#pragma once
// A first metric reconstruction of the plane and the cameras before it (R5), from homographies and
// a focal length.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "engine/camera/calibration/planar_views.h"
#include "engine/camera/calibration/view_tree.h"
#include "storage/base/transform.h"

namespace veduta {

struct MetricOptions {
  double error_max = 0.01;          // > 0, ImageUnits; of a point that agrees, 16 px of 1600
  uint32_t agreeing_count_min = 8;  // >= 6; points that a view must agree on with the others
  double agreeing_share_min = 0.5;  // (0, 1]; of the view's points that are known
};

// World: the plane is z = 0, its unit the distance of the root's camera from it; cameras are where
// z is positive.
struct MetricReconstruction {
  std::vector<std::optional<Rigid3>>
      cams_from_world;  // nothing for a view that could not be placed
  std::vector<std::optional<Eigen::Vector2d>>
      points;  // x, y; nothing for a point that no placed view sees
};

// The mean of the largest group of places that lie within `distance_max` of one of its members;
// nothing for no places.
std::optional<Eigen::Vector2d> Consensus(const std::vector<Eigen::Vector2d>& places,
                                         double distance_max);

// The root of the tree and the plane's normal, on which all its homographies agree best, make the
// first view; what it sees is cut with the plane. Then, the view that sees most known points first,
// absolute poses; a view placed adds what it sees. A point's position is the mean of the largest
// group of views that agree on it: one that moved between photos lies where most saw it.
//
// views: undistorted. focal: in ImageUnits, the principal point in the centre. Deterministic.
// O(views^2 * points).
MetricReconstruction InitializeMetric(const std::vector<PlanarView>& views, const ViewTree& tree,
                                      double focal, const MetricOptions& options = {});

}  // namespace veduta
