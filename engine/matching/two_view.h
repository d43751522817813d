// SPDX-License-Identifier: Apache-2.0
#pragma once
// Verifies that two photos see the same scene: calibrated epipolar geometry by the five-point
// algorithm in RANSAC (R12), and what kind of geometry it is.

#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/pair.h"
#include "storage/model/pinhole.h"

namespace veduta {

struct TwoViewOptions {
  // (0, 100) px: the greatest Sampson distance of an inlier. Chosen by hand; not measured.
  double error_px_max = 2.0;
  // (0, 1): with this probability one sample is free of outliers; the paper's section 3.2.
  double confidence = 1.0 - 1e-4;
  // >= 5; the paper's section 3.2.
  uint32_t inlier_count_min = 20;
  // [0, 1] of the matches: fewer is what chance finds on repeated texture. Chosen by hand.
  double inlier_share_min = 0.3;
  // [0, samples_max]: the usual stopping rule is too hopeful where texture repeats. By hand.
  uint32_t samples_min = 50;
  // >= 1 samples of five matches each. Chosen by hand.
  uint32_t samples_max = 800;
  // After so many samples with less than half of the inliers that are needed the pair is given up.
  // Any number; chosen by hand.
  uint32_t samples_hopeless = 100;
  // [0, 1] of the inliers: where one homography explains so many, the pair is planar. By hand.
  double planar_share_min = 0.85;
  // [0, 1] of the inliers: where a rotation alone explains so many, the pair is one. By hand.
  double rotation_share_min = 0.85;

  Status Check() const;  // the first violated bound, named with its value
};

enum class TwoViewOutcome : uint8_t { kVerified, kTooFewMatches, kTooFewInliers };

struct TwoViewGeometry {
  TwoViewOutcome outcome = TwoViewOutcome::kTooFewMatches;
  PairGeometry geometry = PairGeometry::kGeneral;
  Rigid3 b_from_a;                // |translation| = 1; its direction means nothing for kRotation
  std::vector<uint32_t> inliers;  // ascending columns
};

// Estimates the geometry of matches x_a[i] <-> x_b[i], in normalised image coordinates
// (Pinhole::Normalize), ordered with the most trustworthy first: samples are drawn from the front
// before the whole (as PROSAC does, Chum and Matas 2005). `focal_px` turns pixel thresholds into
// normalised ones. Deterministic in its inputs. Thread-safe.
// `options` must pass their Check; whoever sets them asks it.
TwoViewGeometry EstimateTwoView(std::span<const Eigen::Vector2d> x_a,
                                std::span<const Eigen::Vector2d> x_b, double focal_px,
                                uint64_t seed, const TwoViewOptions& options);

// What kind of geometry the inliers (indices into x_a and x_b, as in EstimateTwoView) have.
PairGeometry Classify(std::span<const Eigen::Vector2d> x_a, std::span<const Eigen::Vector2d> x_b,
                      std::span<const uint32_t> inliers, double focal_px, uint64_t seed,
                      const TwoViewOptions& options);

// Sampson distance, in normalised units, of a match to the essential matrix (Hartley and
// Zisserman 11.4.3).
double SampsonDistance(const Eigen::Matrix3d& b_essential_a, const Eigen::Vector2d& x_a,
                       const Eigen::Vector2d& x_b);
// The same with the sign of its side of the epipolar line.
double SignedSampsonDistance(const Eigen::Matrix3d& b_essential_a, const Eigen::Vector2d& x_a,
                             const Eigen::Vector2d& x_b);

// [t]x R of b_from_a.
Eigen::Matrix3d EssentialFromPose(const Rigid3& b_from_a);

// The best of the four poses of an essential matrix: that with the most of the matches in front of
// both cameras.
Rigid3 PoseFromEssential(const Eigen::Matrix3d& b_essential_a, std::span<const Eigen::Vector2d> x_a,
                         std::span<const Eigen::Vector2d> x_b);

// Minimises the robust sum of squared Sampson distances over rotation and direction of translation
// (Gauss-Newton on the five degrees of freedom); `scale` is the distance beyond which a match loses
// weight (Cauchy).
Rigid3 RefineTwoView(const Rigid3& b_from_a, std::span<const Eigen::Vector2d> x_a,
                     std::span<const Eigen::Vector2d> x_b, double scale);

// All matches within `distance_max` (normalised) of the geometry and in front of both cameras,
// ascending.
std::vector<uint32_t> FindTwoViewInliers(const Rigid3& b_from_a,
                                         std::span<const Eigen::Vector2d> x_a,
                                         std::span<const Eigen::Vector2d> x_b, double distance_max);

// How many of the matches a rotation alone, or one homography, explains within `distance_max`
// (normalised).
uint32_t CountRotationInliers(std::span<const Eigen::Vector2d> x_a,
                              std::span<const Eigen::Vector2d> x_b, double distance_max,
                              uint64_t seed);
uint32_t CountHomographyInliers(std::span<const Eigen::Vector2d> x_a,
                                std::span<const Eigen::Vector2d> x_b, double distance_max,
                                uint64_t seed);

}  // namespace veduta
