// SPDX-License-Identifier: Apache-2.0
#pragma once
// Houses: walls with recessed windows and doors, sills, cornices, balconies, shop signs, posters
// and roofs.

#include <span>

#include "tools/render/street/quad_mesh.h"

namespace veduta::street {

// A stretch of a row of houses whose facades stand elsewhere, too: the same seed and length make
// the same facades, lit the same. Their signs and posters differ.
struct TwinHouses {
  double from_m = 0, length_m = 0;  // in the row; at least 7 m long
  uint64_t seed = 1;
};

// Fills `length_m` of a block's edge with houses side by side, from the frame's origin along it.
//
// seed      of this edge. With `repeated` every house is one bay of kRepeatPeriodM and looks like
// every other,
//           whatever the edge: pass the scene's seed.
// twins     ascending and apart from each other; none with `repeated`.
// Deterministic.
void AddHouseRow(const WallFrame& frame, double length_m, uint64_t seed, bool repeated,
                 std::span<const TwinHouses> twins, QuadMesh& mesh);

}  // namespace veduta::street
