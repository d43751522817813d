// SPDX-License-Identifier: Apache-2.0
#pragma once
// The absolute pose of a calibrated camera before a plane, from points known on it.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "storage/base/transform.h"

namespace veduta {

struct PlanePose {
  Rigid3 cam_from_world;          // the plane is z = 0
  std::vector<uint32_t> inliers;  // ascending
};

// plane  [N] x, y on the plane z = 0 of the world.
// x      [N] where they are seen, normalised image coordinates without distortion.
//
// The robust homography from the plane to the image is (r1 r2 t) up to scale; the nearest rotation
// is taken. A point agrees if its error is below error_max, in the units of x. Nothing if fewer
// than 6 points agree. Deterministic in its inputs and the seed. [Zhang 2000]
std::optional<PlanePose> EstimatePlanePose(std::span<const Eigen::Vector2d> plane,
                                           std::span<const Eigen::Vector2d> x, double error_max,
                                           uint64_t seed);

}  // namespace veduta
