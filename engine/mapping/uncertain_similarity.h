// SPDX-License-Identifier: Apache-2.0
#pragma once
// Similarities that are known to some exactness, along a chain of frames and where a chain closes.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/similarity.h"
#include "storage/base/transform.h"

namespace veduta {

struct UncertainSimilarity {
  Sim3 b_from_a;
  SimilarityCovariance covariance;  // of frame b
};

// c_from_a: the errors of the two are independent.
UncertainSimilarity Chain(const UncertainSimilarity& c_from_b, const UncertainSimilarity& b_from_a);

// The identity, as the frame itself is known: seen from `pivot`, the rest of it may be turned (rad,
// about any axis) and scaled (logarithm) by such standard deviations.
UncertainSimilarity Bend(const Eigen::Vector3d& pivot, double rotation_deviation,
                         double log_scale_deviation);

// One feature of either frame's camera that show the same place.
struct CrossMatch {
  Rigid3 cam_b_from_b;
  Eigen::Vector2d x_b;  // normalised image coordinates
  Rigid3 cam_a_from_a;
  Eigen::Vector2d x_a;
  double focal_px = 1000;  // the smaller of both, by which the error weighs
};

// What is seen across two frames: cameras of b that see points of a, the reverse, and matches.
struct SeenAcross {
  std::span<const CrossSighting> in_b, in_a;
  std::span<const CrossMatch> matches;
};

struct ClosedSimilarity {
  Sim3 b_from_a;
  double distance = 0;  // Mahalanobis, from what was known
};

// The similarity that what is known and what is seen across give together: it minimises the squared
// Mahalanobis distance and the robust sum of squared errors, px: of points in cameras, and of
// matches to their epipolar lines (Sampson). It is sought from 64 px on down to 2. Nothing where
// what is known has no finite covariance. O(seen).
std::optional<ClosedSimilarity> CloseChain(const UncertainSimilarity& known,
                                           const SeenAcross& seen);

// Where the frames 1 to n of a chain 0 <- 1 <- ... <- n are, in frame 0, once it is known where the
// last one is: each link takes as much of what the chain was off as its covariance has of the whole
// (the most likely links, for small motions). At least one link.
std::vector<Sim3> SpreadOver(std::span<const UncertainSimilarity> links,
                             const Sim3& first_from_last);

}  // namespace veduta
