// SPDX-License-Identifier: Apache-2.0
#pragma once
// A piece of a surface as the content of a tile of 3D Tiles 1.1.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

// A binary glTF 2.0 with one mesh without normals on an unlit material. Its z-up frame is the
// mesh's: viewers of 3D Tiles turn glTF's y-up frame into that. Positions are 32-bit floats
// relative to `center`, which is the translation of the mesh's node, so they are as exact far from
// the origin as near it; colours are light in 16 bits, grey where the mesh has none. An empty mesh
// gives an empty scene. Deterministic; O(size). kInvalidArgument as CheckMesh, or where `center` is
// not finite.
Result<std::vector<uint8_t>> MakeGlbTile(const TriangleMesh& mesh, const Eigen::Vector3d& center);

}  // namespace veduta
