// SPDX-License-Identifier: Apache-2.0
#pragma once
// A first metric reconstruction of the plane and the cameras before it (R5), from homographies and
// a focal length.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "engine/camera/calibration/planar_views.h"
#include "engine/camera/calibration/view_tree.h"
#include "storage/base/status.h"
#include "storage/base/transform.h"

namespace veduta {

struct MetricOptions {
  // ImageUnits; > 0. The largest error of a point that agrees: 16 px of 1600. Chosen by hand; not
  // measured.
  double error_max = 0.01;
  // >= 6; how many points a view and the others must agree on. Twice what a homography needs.
  uint32_t agreeing_count_min = 8;
  // (0, 1]; the share that must agree of the view's points that are known. Half: the majority
  // decides.
  double agreeing_share_min = 0.5;

  Status Check() const;  // the first violated bound, named with its value
};

// World: the plane is z = 0, its unit the distance of the root's camera from it; cameras are where
// z is positive.
struct MetricReconstruction {
  // Of each view; nothing for a view that could not be placed.
  std::vector<std::optional<Rigid3>> cams_from_world;
  // x and y of each point; nothing for a point that no placed view sees.
  std::vector<std::optional<Eigen::Vector2d>> points;
};

// The mean of the largest group of places that lie within `distance_max` of one of its members;
// nothing for no places.
std::optional<Eigen::Vector2d> Consensus(const std::vector<Eigen::Vector2d>& places,
                                         double distance_max);

// The first view is the tree's root; the plane's normal is the one on which the tree's homographies
// agree best. The points that the root sees lie where its rays meet the plane. Then the other views
// get absolute poses one by one, always the one that sees most known points, and each adds the
// points that it sees. A point lies at the mean of the largest group of views that agree on it: a
// point that moved between the photos lies where most photos saw it.
//
// views: undistorted. focal: in ImageUnits, the principal point in the centre. Deterministic.
// O(views^2 * points).
MetricReconstruction InitializeMetric(const std::vector<PlanarView>& views, const ViewTree& tree,
                                      double focal, const MetricOptions& options = {});

}  // namespace veduta
