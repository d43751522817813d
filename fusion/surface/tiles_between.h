// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which photos can see a piece of surface, and which tiles can stand between.

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "storage/model/view.h"

namespace veduta {

// False only where no point of `box` is in the view's frustum, its edges at the outermost pixels'
// outer edges. O(1).
bool MaySee(const ViewGeometry& view, const Eigen::AlignedBox3d& box);

// Whether `box` meets the convex hull of a point and a box. Exact up to rounding; touching counts.
// O(1).
bool MeetsHull(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& center,
               const Eigen::AlignedBox3d& target);

// The indices of all `boxes` that meet the hull of `target` and one of the `centers`, ascending: a
// scene of these decides visibility of everything in `target` from the centers. O(boxes * centers).
std::vector<uint32_t> TilesBetween(std::span<const Eigen::AlignedBox3d> boxes,
                                   const Eigen::AlignedBox3d& target,
                                   std::span<const Eigen::Vector3d> centers);

}  // namespace veduta
