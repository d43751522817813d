// SPDX-License-Identifier: Apache-2.0
#pragma once
// Grows tracks and points around a newly placed image: accuracy comes from many well-measured
// correspondences.

#include <span>

#include "engine/mapping/map.h"
#include "engine/mapping/placement.h"

namespace veduta {

struct GrowthOptions {
  double error_px_max = 3.0;      // > 0: reprojection error of an observation before adjustment
  double angle_deg_min = 2.0;     // [0, 90): of a new point; the paper's section 3.3
  double search_radius_px = 3.0;  // > 0: around a projected point
  uint32_t descriptor_distance_squared_max = 90'000;  // root-SIFT bytes have norm 512
  double scale_ratio_max = 1.6;  // >= 1: of a feature's measured scale to that predicted from depth
  uint32_t views_min = 2;        // >= 2: of a new point
  uint32_t guided_views_min =
      3;  // >= 2: of one whose matches were found by known poses: two agree by chance too easily
  double guided_band_px = 1.5;    // (0, 64]: from the epipolar line
  double guided_ratio_max = 0.8;  // (0, 1]: against the second best in the band
};

struct GrowthCounts {
  uint32_t observations_added = 0, points_added = 0, points_merged = 0;
};

// Joins the features of a placed image to the points that its verified matches lead to, merging
// points that turn out to be one, and triangulates matches that have none yet. Pairs with images of
// other reconstructions are passed over. Matched images must be loaded with their points, and all
// images in those points' tracks.
GrowthCounts GrowFromMatches(Map* map, ImageId image, std::span<const PairMatches> pairs,
                             const GrowthOptions& options);

// Matches the features of two placed images along the epipolar lines of their poses. Reads the map
// only.
PairMatches MatchPlaced(const Map& map, ImageId image, ImageId other, const GrowthOptions& options);

// Two points are one when a single position explains both tracks within `error_px_max`: `drop` then
// joins `keep`. False, and nothing changed, when it does not, they share an image, or one is gone.
// All their images are loaded.
bool TryMergePoints(Map* map, PointId keep, PointId drop, double error_px_max);

// Projects `points` into a placed image and joins those that land by a free feature that looks the
// same.
GrowthCounts GrowByProjection(Map* map, ImageId image, std::span<const PointId> points,
                              const GrowthOptions& options);

}  // namespace veduta
