// SPDX-License-Identifier: Apache-2.0
#pragma once
// Removes the observations and points that adjustment has shown to be wrong (R18).

#include <span>

#include "engine/mapping/city_map.h"
#include "storage/base/status.h"

namespace veduta {

struct PointFilterOptions {
  // > 0, px. An observation with a larger reprojection error leaves its track. Twice the limit for
  // points below; the factor was chosen by hand and not measured.
  double observation_error_px_max = 2.6;
  // > 0, px. A point with a larger mean error over its track is removed; the paper's section 3.3.
  double point_error_px_max = 1.3;
  // [0, 90), degrees. A point whose rays meet at smaller angles is removed; the paper's section
  // 3.3.
  double angle_deg_min = 2.0;
  // > 0, octaves. A point of two views whose feature is so much larger in the world by one view's
  // depth than by the other's is removed: where the line between two cameras meets their pictures,
  // any two features agree upon some depth, and two such points have turned half of a street of 24
  // photos by 0.2 m. On that street 99 of 100 points of two views differ by less than 0.8 octaves.
  double size_octaves_max = 1.5;

  Status Check() const;
};

struct PointFilterCounts {
  uint32_t observations_removed = 0, points_removed = 0;
};

// Judges those of `points` that still exist; every image in their tracks must be loaded.
PointFilterCounts FilterPoints(CityMap* map, std::span<const PointId> points,
                               const PointFilterOptions& options);

}  // namespace veduta
