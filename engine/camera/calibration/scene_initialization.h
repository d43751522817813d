// SPDX-License-Identifier: Apache-2.0
#pragma once
// From observations alone to a camera, poses and points near enough for the final adjustment: R3,
// R4 and the first half of R5 one after the other.

#include <vector>

#include "engine/camera/calibration/inverse_distortion.h"
#include "engine/camera/calibration/metric_initialization.h"
#include "engine/camera/calibration/planar_views.h"
#include "storage/base/status.h"
#include "storage/model/camera.h"

namespace veduta {

struct InitialScene {
  InverseDistortion distortion;
  CameraModel camera;               // of the size given; principal point in the centre
  double focal_px = 0;              // what the search said
  double normals_disagree_deg = 0;  // at that focal length
  MetricReconstruction metric;
};

// kInvalidArgument with what to photograph if fewer than 3 photos can be joined by points in
// common. Deterministic. About 0.1 s for 20 photos.
Result<InitialScene> InitializeScene(const PlanarViews& planar, ImageSize size);

inline constexpr size_t kFocalReferences = 6;  // views that vote on the focal length; by hand

// The homographies between undistorted views, from each of the first `references` views of the tree
// to all others. SearchFocalLength takes them.
std::vector<std::vector<Eigen::Matrix3d>> HomographiesFromReferences(const ViewTree& tree,
                                                                     size_t references);

}  // namespace veduta
