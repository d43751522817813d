// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the photos of a reconstruction see surveyed points.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "storage/database.h"

namespace veduta {

struct SeenGroundPoint {
  size_t point = 0;  // its index
  ReconstructionId reconstruction;
  Eigen::Vector3d world;
  // Of that along each axis, world units, if photos show it to 1 px; where they disagree by more,
  // that is not taken for the mean of independent errors.
  double deviation = 0;
  double error_px = 0;  // root mean square over the photos
};

// Triangulates each point in each reconstruction of which two photos and more show it; in the order
// of the points. One that is seen from one side only, by parallel rays, is left out.
// O(sightings). Thread-safe.
Result<std::vector<SeenGroundPoint>> SeeGroundPoints(const Snapshot& snapshot,
                                                     std::span<const GroundPoint> points);

}  // namespace veduta
