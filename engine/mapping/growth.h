// SPDX-License-Identifier: Apache-2.0
#pragma once
// Grows tracks and points around a placed image: many well-measured correspondences are what makes
// poses accurate.

#include <span>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pair_matches.h"
#include "storage/base/status.h"

namespace veduta {

struct GrowthOptions {
  // > 0, px. Reprojection error up to which an observation joins a point before adjustment. Chosen
  // by hand; not measured.
  double error_px_max = 3.0;
  // [0, 90), degrees. Smallest angle between the rays of a new point; the paper's section 3.3.
  double angle_deg_min = 2.0;
  // > 0, px. A feature so near to a projected point may be the point's. As error_px_max.
  double search_radius_px = 3.0;
  // >= 1. Squared distance of two descriptors up to which they may show the same place. Root-SIFT
  // bytes have a norm of 512, so 90 000 (a distance of 300) is an angle of 34 degrees. Chosen by
  // hand; not measured.
  uint32_t descriptor_distance_squared_max = 90'000;
  // >= 1. A feature's measured scale over the scale that the depth predicts, or the inverse, at
  // most. 1.6 is two thirds of an octave. Chosen by hand; not measured.
  double scale_ratio_max = 1.6;
  // >= 2. Views that a new point needs; two rays are the least that meet in a point.
  uint32_t views_min = 2;
  // >= 2. Views that a new point needs when its matches were found by means of known poses: two
  // such matches agree by chance too easily, a third seldom does. Chosen by hand; not measured.
  uint32_t guided_views_min = 3;
  // (0, 64], px. Distance from the epipolar line up to which features are compared. Chosen by hand;
  // not measured. The upper bound is the matcher's (GuidedMatchOptions).
  double guided_band_px = 1.5;
  // (0, 1]. Distance to the best candidate in the band over that to the second best; Lowe 2004,
  // section 7.1.
  double guided_ratio_max = 0.8;

  Status Check() const;
};

struct GrowthCounts {
  uint32_t observations_added = 0, points_added = 0, points_merged = 0;
};

// Joins the features of a placed image to the points that its verified matches lead to, merging
// points that turn out to be one, and triangulates matches that have none yet. Pairs with images of
// other reconstructions are passed over. The matched images must be loaded with their points, and
// so must all images in the tracks of those points.
GrowthCounts GrowFromMatches(CityMap* map, ImageId image, std::span<const PairMatches> pairs,
                             const GrowthOptions& options);

// Matches the features of two placed images along the epipolar lines of their poses. No matches
// where both cameras stand in one place. Reads the map only.
PairMatches MatchPlaced(const CityMap& map, ImageId image, ImageId other,
                        const GrowthOptions& options);

// Two points are one when a single position explains both tracks within `error_px_max`; the track
// of `drop` then joins that of `keep`. Returns false and changes nothing when no position does,
// when the two share an image, or when one of them no longer exists. All their images must be
// loaded.
bool TryMergePoints(CityMap* map, PointId keep, PointId drop, double error_px_max);

}  // namespace veduta
