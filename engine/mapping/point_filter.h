// SPDX-License-Identifier: Apache-2.0
#pragma once
// Removes what adjustment has shown to be wrong (R18).

#include <span>

#include "engine/mapping/map.h"

namespace veduta {

struct PointFilterOptions {
  double observation_error_px_max =
      2.6;                          // > 0: a worse observation leaves its track; twice the next
  double point_error_px_max = 1.3;  // > 0: mean over the track; the paper's section 3.3
  double angle_deg_min = 2.0;  // [0, 90): largest angle between two rays; the paper's section 3.3
};

struct PointFilterCounts {
  uint32_t observations_removed = 0, points_removed = 0;
};

// Judges the live ones among `points`; every image in their tracks must be loaded.
PointFilterCounts FilterPoints(Map* map, std::span<const PointId> points,
                               const PointFilterOptions& options);

}  // namespace veduta
