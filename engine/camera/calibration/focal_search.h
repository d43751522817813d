// SPDX-License-Identifier: Apache-2.0
#pragma once
// The focal length from homographies between views of one plane, by search (R4, equations 3 and 4).

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

// What is searched. Focal lengths are in the units of the homographies' coordinates.
struct FocalSearchOptions {
  double focal_min = 0.3;  // > 0; the paper's section 2
  double focal_max = 3;    // > focal_min; the paper's section 2
  // [8, 10000]; steps in equal ratios, 5 % each from 0.3 to 3. The best one is refined afterwards.
  // Chosen by hand; not measured.
  uint32_t step_count = 48;

  Status Check() const;  // the first violated bound, named with its value
};

struct FocalEstimate {
  double focal = 0;  // in the same units
  // The mean angle between the views' normals and their mean at that focal length.
  double disagreement_deg = 0;
};

// Each candidate f makes K = diag(f, f, 1), and each homography a pair of normals of the plane in
// the reference view, by the decomposition of K^-1 H K; at the right one the normals agree.
//
// other_from_reference  homographies between undistorted views, about the principal point (assumed
// known: the image's
//                       centre), one list a reference view; several references vote with the sum of
//                       their scores.
//
// Nothing if there are no homographies. Deterministic, thread-safe, O(steps * homographies): about
// 1 us each.
std::optional<FocalEstimate> SearchFocalLength(
    std::span<const std::vector<Eigen::Matrix3d>> other_from_reference,
    const FocalSearchOptions& options = {});

// The normal of the plane in the reference view that the homographies agree on best, at a known
// focal length. Expects at least one homography.
Eigen::Vector3d AgreedNormal(std::span<const Eigen::Matrix3d> other_from_reference, double focal);

}  // namespace veduta
