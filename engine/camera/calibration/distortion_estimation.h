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
  InverseDistortion start;   // the paper's: the image's centre and no distortion
  uint32_t extra_pairs = 3;  // a view, besides the adjacent ones of the tree
  double center_sigma =
      0.05;  // > 0, ImageUnits; how far from the image's centre c is thought to lie
  double coefficient_sigma =
      2;  // > 0; likewise of k1 and k2, which a few points near the centre leave open
  double loss_scale =
      0.004;  // > 0, ImageUnits; where errors start to count less (Cauchy), 6 px of 1600
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
// Levenberg-Marquardt with Cauchy's loss; one thread. kInvalidArgument if the solver fails.
Result<DistortionEstimate> EstimateDistortion(const std::vector<PlanarView>& views,
                                              const DistortionOptions& options, ViewTree* tree);

}  // namespace veduta
