// SPDX-License-Identifier: Apache-2.0
#pragma once
// Places one image against the points already in a reconstruction (R12, R14).

#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/status.h"
#include "storage/base/transform.h"
#include "storage/model/pinhole.h"

namespace veduta {

struct ResectionOptions {
  double error_px_max = 4.0;       // (0, 100): reprojection error of an inlier
  uint32_t inlier_count_min = 20;  // >= 4; the paper's section 3.2
  double inlier_share_min = 0.15;  // [0, 1]; fewer of the correspondences than this explain nothing
  double confidence = 1.0 - 1e-4;  // (0, 1); the paper's section 3.2
  uint32_t samples_max = 3000;     // >= 1

  Status Check() const;
};

enum class ResectionOutcome : uint8_t { kPlaced, kTooFewMatches, kTooFewInliers };

struct Resection {
  ResectionOutcome outcome = ResectionOutcome::kTooFewMatches;
  Rigid3 cam_from_world;          // in the scale of the points
  std::vector<uint32_t> inliers;  // ascending indices of the inputs
};

// Estimates cam_from_world by P3P (Kneip 2011) inside RANSAC, refined on the inliers by robust
// Gauss-Newton.
//
// x           normalised image coordinates, most trustworthy first.
// points      where the same features lie in the reconstruction.
//
// Deterministic in its inputs. Thread-safe. O(samples * N).
Resection Resect(std::span<const Eigen::Vector2d> x, std::span<const Eigen::Vector3d> points,
                 double focal_px, uint64_t seed, const ResectionOptions& options);

// Estimates cam_from_world along the baseline to a neighbour of known pose: their verified
// geometry, `cam_from_neighbor` with a translation of unit length, gives all but the baseline's
// length, and the points that. Fewer of them do than for P3P: whoever moves forward shares many
// matches with the last photo, and few of them are points yet. x, points, outcome: as above.
// O(N^2).
Resection ResectAlong(const Rigid3& cam_from_neighbor, const Rigid3& neighbor_from_world,
                      std::span<const Eigen::Vector2d> x, std::span<const Eigen::Vector3d> points,
                      double focal_px, const ResectionOptions& options);

// Minimises the Cauchy-weighted squared reprojection error over the six degrees of freedom of the
// pose.
Rigid3 RefinePose(const Rigid3& cam_from_world, std::span<const Eigen::Vector2d> x,
                  std::span<const Eigen::Vector3d> points, double scale);

}  // namespace veduta
