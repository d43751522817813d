// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "storage/base/status.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

// kInvalidArgument, naming the first element that is wrong, unless positions and normals are
// finite, normals and colours are none or one a position, and triangles name positions. An empty
// mesh is right. O(size).
Status CheckMesh(const TriangleMesh& mesh);

// The unit normal of every vertex: the mean of its triangles' normals, weighted by their areas;
// zero for a vertex without any. Deterministic. For meshes that come without; at the border of a
// tile it knows one side only.
std::vector<Eigen::Vector3f> VertexNormals(const TriangleMesh& mesh);

}  // namespace veduta
