// SPDX-License-Identifier: Apache-2.0
#pragma once
// The similarity between two reconstructions from points that both have (R15).

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/cross_sighting.h"
#include "storage/base/transform.h"

namespace veduta {

// Least-squares similarity b_from_a of corresponding points (Umeyama 1991). Nothing for fewer than
// three points or points on a line.
std::optional<Sim3> FitSimilarity(std::span<const Eigen::Vector3d> points_a,
                                  std::span<const Eigen::Vector3d> points_b);

// The similarity b_from_a that best carries cameras of one frame to where they are in another: by
// their centres, and a typical spacing along two of their axes, so that cameras on a line fix it,
// too. Equally many of both. Nothing where all are in one place. O(cameras).
std::optional<Sim3> FitCameras(std::span<const Rigid3> cams_from_a,
                               std::span<const Rigid3> cams_from_b);

struct RobustSimilarity {
  Sim3 b_from_a;
  std::vector<uint32_t> inliers;  // ascending
};

// RANSAC over triples of correspondences. `is_inlier(b_from_a, i)` judges correspondence i, so that
// the caller can measure in the photos, where errors are in pixels, rather than in space, where
// they grow with distance. The best similarity is fitted again to all its inliers. Deterministic in
// its inputs. Nothing when fewer than `inlier_count_min` correspondences agree. O(samples * N).
std::optional<RobustSimilarity> EstimateSimilarity(
    std::span<const Eigen::Vector3d> points_a, std::span<const Eigen::Vector3d> points_b,
    const std::function<bool(const Sim3&, size_t)>& is_inlier, uint32_t inlier_count_min,
    uint64_t seed);

// How far a similarity may be from the truth, for errors of 1 px: in frame b, of rotation (rad),
// translation, and the scale's logarithm.
struct SimilarityCovariance {
  Eigen::Matrix<double, 7, 7> matrix;

  // Infinite where what is seen does not determine it.
  double LogScaleDeviation() const;
  // How far a point that the similarity carries to `x_b` may be off: the length of its standard
  // deviations.
  double PositionDeviation(const Eigen::Vector3d& x_b) const;
};

// `in_b` are cameras of b that see points of a; `in_a` the reverse. At `scale_px` an error loses
// half of its weight (Cauchy). O(N).
SimilarityCovariance CovarianceOf(const Sim3& b_from_a, std::span<const CrossSighting> in_b,
                                  std::span<const CrossSighting> in_a, double scale_px);

// Moves a similarity to where points of each frame project best into cameras of the other: one that
// was found by points that both frames know is as exact as these points, and all others that are
// seen across say more. Sightings and weights as above; Gauss-Newton over the seven degrees of
// freedom of the weighted squared reprojection error. O(N).
Sim3 RefineSimilarity(const Sim3& b_from_a, std::span<const CrossSighting> in_b,
                      std::span<const CrossSighting> in_a, double scale_px);

}  // namespace veduta
