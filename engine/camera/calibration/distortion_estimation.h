// SPDX-License-Identifier: Apache-2.0
#pragma once
// Lens distortion from homographies between views of a plane (R3, equations 1 and 2).

#include <vector>

#include "engine/camera/calibration/inverse_distortion.h"
#include "engine/camera/calibration/planar_views.h"
#include "engine/camera/calibration/view_tree.h"
#include "storage/base/status.h"

namespace veduta {

struct DistortionOptions {
  InverseDistortion start;  // the paper's start: the image's centre and no distortion
  // >= 0; the pairs added for each view, besides the adjacent ones of the tree. Chosen by hand; not
  // measured.
  uint32_t extra_pairs = 3;
  // ImageUnits; > 0. How far the centre of distortion is thought to lie from the image's centre.
  // Chosen by hand; not measured.
  double center_sigma = 0.05;
  // > 0; how large k1 and k2 are thought to be. Points near the centre alone leave them open.
  // Chosen by hand; not measured.
  double coefficient_sigma = 2;
  // ImageUnits; > 0. Where Cauchy's loss begins to weigh an error less: 6 px of 1600. Chosen by
  // hand; not measured.
  double loss_scale = 0.004;

  Status Check() const;  // the first violated bound, named with its value
};

struct DistortionEstimate {
  InverseDistortion distortion;
  double residual_median = 0;  // ImageUnits, in the photo
};

// Minimises over theta = (c, k1, k2) and the tree's homographies, which become those between
// undistorted views,
//   sum_ij sum_k | J^-1 (D~(x_j^k) - H_ij D~(x_i^k)) |^2 / sigma^2,
// H_ij being the product of the adjacent homographies along the tree. Equation 1 has no J, the
// derivative of D~ at x_j^k: with it errors are measured in the photo, and a distortion that merely
// shrinks everything does not look good. Starts at the given homographies. Ceres, sparse
// Levenberg-Marquardt with Cauchy's loss; one thread. kInvalidArgument on bad options, or if the
// solver fails.
Result<DistortionEstimate> EstimateDistortion(const std::vector<PlanarView>& views,
                                              const DistortionOptions& options, ViewTree* tree);

}  // namespace veduta
