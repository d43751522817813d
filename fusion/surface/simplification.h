// SPDX-License-Identifier: Apache-2.0
#pragma once
// Fewer triangles, within a distance. OpenMesh stays behind this header.

#include <cstdint>
#include <vector>

#include "fusion/surface/simplification_options.h"
#include "storage/base/status.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

struct SimplifiedMesh {
  TriangleMesh mesh;  // a subset of the vertices, with their normals and colours
  std::vector<uint32_t>
      source_vertex;    // ascending; which vertex of the input each one was: keys follow by it
  double distance = 0;  // measured between the two surfaces, both ways, at vertices, middles of
                        // edges and of triangles; <= distance_max
};

// Half-edge collapses in order of quadric error (Garland and Heckbert 1997), each allowed only
// while the old points stay within the bound; then the distance is measured, and all is done again
// with a smaller bound where it is exceeded. Triangles at edges of more than two triangles stay as
// they are. Deterministic. Thread-safe. kInvalidArgument on bad options or a broken mesh.
Result<SimplifiedMesh> Simplify(const TriangleMesh& mesh, const SimplificationOptions& options);

// The greatest distance from samples of `from` (vertices, middles of edges and triangles, edges
// divided to be no longer than `spacing`) to the nearest point of `to`. 0 if `from` has no
// triangle; infinite if only `to` has none. kInvalidArgument on broken meshes or a spacing that is
// not positive. O(samples * log(triangles of to)).
Result<double> DistanceTo(const TriangleMesh& from, const TriangleMesh& to, double spacing);

}  // namespace veduta
