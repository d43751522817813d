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
  // (0, 100), px. Reprojection error of an inlier. Chosen by hand; not measured.
  double error_px_max = 4.0;
  // >= 4. A pose that fewer points agree with is none; the paper's section 3.2. Three points are
  // what P3P needs, and a fourth tells its solutions apart.
  uint32_t inlier_count_min = 20;
  // [0, 1]. A pose that a smaller share of the correspondences agrees with is none. Chosen by hand;
  // not measured.
  double inlier_share_min = 0.15;
  // (0, 1). Of having drawn a sample without outliers; the paper's section 3.2.
  double confidence = 1.0 - 1e-4;
  // >= 1. Enough for a confidence of 1 - 1e-4 at a share of inliers of 0.145 (Fischler and Bolles
  // 1981, samples of 3), which is just below inlier_share_min.
  uint32_t samples_max = 3000;
  // > 0, px. A correspondence that lies farther from where a pose puts it may speak for quite
  // another pose. Chosen by hand; not measured.
  double rival_error_px_min = 15.0;
  // [0, 1]. Where quite another pose explains such a share of what the best one explains, neither
  // is believed. Of 105 right poses on a street two or three had a rival, of 0.3 at most; of 13 on
  // castle-P19 the greatest was 0.08. On a facade that repeats every 3 m half had one of 0.3 and
  // more.
  double rival_share_max = 0.25;

  bool IsAmbiguous(size_t inlier_count, size_t rival_count) const {
    return static_cast<double>(rival_count) > rival_share_max * static_cast<double>(inlier_count);
  }
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

// Estimates cam_from_world along the baseline to a neighbour whose pose is known. The verified
// geometry of the two, `cam_from_neighbor` with a translation of unit length, gives everything but
// the length of the baseline, and one point is enough to give that. So fewer points are needed than
// for P3P: whoever walks forward shares many matches with the last photo, few of which are points
// yet. x, points and outcome are as in Resect. O(N^2).
Resection ResectAlong(const Rigid3& cam_from_neighbor, const Rigid3& neighbor_from_world,
                      std::span<const Eigen::Vector2d> x, std::span<const Eigen::Vector3d> points,
                      double focal_px, const ResectionOptions& options);

// What a pose explains of the correspondences, and whether that is enough. O(N).
Resection JudgePose(const Rigid3& cam_from_world, std::span<const Eigen::Vector2d> x,
                    std::span<const Eigen::Vector3d> points, double focal_px,
                    const ResectionOptions& options);

// The correspondences that may speak for quite another pose: those that lie farther than
// rival_error_px_min from where this one puts them. Ascending indices. O(N).
std::vector<uint32_t> ListRivals(const Rigid3& cam_from_world, std::span<const Eigen::Vector2d> x,
                                 std::span<const Eigen::Vector3d> points, double focal_px,
                                 const ResectionOptions& options);

// How many of the correspondences that `found` does not explain the best pose by them alone does: a
// facade that repeats gives a pose for each window. 0 where there is none by inlier_count_min.
uint32_t CountRivalInliers(std::span<const Eigen::Vector2d> x,
                           std::span<const Eigen::Vector3d> points, double focal_px,
                           const Resection& found, uint64_t seed, const ResectionOptions& options);

// Minimises the Cauchy-weighted squared reprojection error over the six degrees of freedom of the
// pose.
Rigid3 RefinePose(const Rigid3& cam_from_world, std::span<const Eigen::Vector2d> x,
                  std::span<const Eigen::Vector3d> points, double scale);

}  // namespace veduta
