// SPDX-License-Identifier: Apache-2.0
#pragma once
// Houses: walls with recessed windows and doors, sills, cornices, balconies, shop signs, posters
// and roofs.

#include "tools/render/street/quad_mesh.h"

namespace veduta::street {

// Fills `length_m` of a block's edge with houses side by side, from the frame's origin along it.
//
// seed      of this edge. With `repeated` every house is one bay of kRepeatPeriodM and looks like
// every other,
//           whatever the edge: pass the scene's seed.
// Deterministic.
void AddHouseRow(const WallFrame& frame, double length_m, uint64_t seed, bool repeated,
                 QuadMesh& mesh);

}  // namespace veduta::street
