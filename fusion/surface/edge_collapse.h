// SPDX-License-Identifier: Apache-2.0
#pragma once
// Collapses of half-edges in order of quadric error, while the old surface stays near. One run, for
// Simplify.

#include <cstdint>
#include <vector>

#include "fusion/surface/simplification_options.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

// The triangles that are left, of the same vertices. `distance_max` counts instead of that of the
// options, and holds from the places remembered (old vertices, middles of edges; a dozen a
// triangle) to triangles near them: whoever calls measures. mesh must pass CheckMesh.
std::vector<std::array<uint32_t, 3>> CollapseEdges(const TriangleMesh& mesh,
                                                   const SimplificationOptions& options,
                                                   double distance_max);

}  // namespace veduta
