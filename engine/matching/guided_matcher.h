// SPDX-License-Identifier: Apache-2.0
#pragma once
// Matching where geometry is known already: along epipolar lines, and near a predicted position.

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "engine/matching/feature_grid.h"
#include "engine/matching/mutual_matcher.h"
#include "storage/base/status.h"
#include "storage/model/features.h"

namespace veduta {

struct GuidedMatchOptions {
  // (0, 64] px: the greatest distance of each feature from the other's epipolar line. By hand.
  double band_px = 2.0;
  // [0, 2^32) of squared byte distance: (0.7 * 512)^2, as root-SIFT's norm is 512; the share of 0.7
  // is chosen by hand. The greatest number: off.
  uint32_t distance_squared_max = 128'450;
  // (0, 1]: distance (not squared) over that of the second best in the band; 1: off. By hand.
  double ratio_max = 0.85;
  // >= 0 px: the second best lies farther than this from the best, else both show the same thing.
  // Chosen by hand.
  double apart_px = 4.0;
  // >= 1: the larger of two matched features' scale_px over the smaller; infinity: off.
  double scale_ratio_max = std::numeric_limits<double>::infinity();

  Status Check() const;  // the first violated bound, named with its value
};

// Buffers that the calls of one thread share, so that only the first allocates.
struct GuidedScratch {
  std::vector<FeatureIndex> candidates;
  std::vector<uint32_t> distances;
};

// Pairs of features that are each other's nearest descriptor (ties: lowest index) among the pairs
// of one contrast class that lie within the band: |x_b^T F x_a| <= band_px * |(F x_a)_xy| and <=
// band_px * |(F^T x_b)_xy|, with F = `b_from_a` in px of any scale (Hartley and Zisserman, 9.2),
// and whose scales agree. Of these, what passes distance and ratio; second_distance_squared is of
// a's best candidate `apart_px` away, UINT32_MAX if none. Ascending in a.
//
// `b_grid` was built from `b`. A degenerate F (zero, not finite) has no lines, so no matches.
// Deterministic, the same on every processor; thread-safe; single-threaded; 2 to 3 ms for 4200 x
// 4200 features. kInvalidArgument on bad options, a grid of other features, or descriptors that are
// not 128 bytes for each keypoint.
Result<std::vector<DescriptorMatch>> MatchGuided(const Features& a, const Features& b,
                                                 const FeatureGrid& b_grid,
                                                 const Eigen::Matrix3d& b_from_a,
                                                 const GuidedMatchOptions& options);

// What to look for, and where.
struct NearQuery {
  double x_px = 0, y_px = 0;
  double radius_px = 0;                 // >= 0, inclusive
  const uint8_t* descriptor = nullptr;  // [128]
  int8_t contrast_sign = 0;
  uint32_t distance_squared_max = UINT32_MAX;
  double apart_px = 4.0;  // the second best lies farther than this from the best
};

struct NearFeature {
  FeatureIndex feature = 0;
  uint32_t distance_squared = 0;
  uint32_t second_distance_squared =
      UINT32_MAX;  // of the best candidate `apart_px` away; UINT32_MAX if none

  bool operator==(const NearFeature&) const = default;
};

// The feature whose descriptor is nearest (ties: lowest index) among those within the radius that
// have the sign; none if there is none, or it is farther than distance_squared_max, or the query is
// not finite. `grid` was built from `features`. Deterministic; thread-safe where each thread has
// its own scratch. Some 0.05 us with a handful of candidates (veduta_matching_benchmark).
std::optional<NearFeature> FindNear(const FeatureGrid& grid, const Features& features,
                                    const NearQuery& query, GuidedScratch* scratch);

}  // namespace veduta
