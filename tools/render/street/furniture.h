// SPDX-License-Identifier: Apache-2.0
#pragma once
// What stands between the houses: road, pavements, trees and parked cars.

#include "tools/render/street/plan.h"
#include "tools/render/street/quad_mesh.h"

namespace veduta::street {

// Asphalt under [low, high], in tiles: each has its own origin, so texture coordinates stay exact
// far out.
void AddGround(const Eigen::Vector2d& low, const Eigen::Vector2d& high, uint64_t seed,
               QuadMesh& mesh);

// The pavement in front of a block's edge of `length_m`, with trees and cars along it.
void AddPavement(const WallFrame& frame, double length_m, uint64_t seed, QuadMesh& mesh);

}  // namespace veduta::street
