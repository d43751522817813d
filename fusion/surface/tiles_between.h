// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which tiles can stand between cameras and a piece of surface.

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

namespace veduta {

// Whether `box` meets the convex hull of a point and a box. Exact up to rounding; touching counts. O(1).
bool MeetsHull(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& center, const Eigen::AlignedBox3d& target);

// The indices of all `boxes` that meet the hull of `target` and one of the `centers`, ascending: a scene of these
// decides visibility of everything in `target` from the centers. O(boxes * centers).
std::vector<uint32_t> TilesBetween(std::span<const Eigen::AlignedBox3d> boxes, const Eigen::AlignedBox3d& target,
                                   std::span<const Eigen::Vector3d> centers);

}  // namespace veduta
