// SPDX-License-Identifier: Apache-2.0
#pragma once
// The surface of a node of a tile tree, from those of its children.

#include <cstdint>
#include <span>

#include "fusion/tileset/tile_tree.h"
#include "storage/base/status.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

// Joins the vertices of each cell of 2^level voxels: to their mean place and the mean of their
// light. Triangles that lose their area that way go, and those that are there twice. Source:
// Rossignac and Borrel, "Multi-resolution 3D approximations for rendering complex scenes", 1993.
// Why not Simplify (fusion/surface/simplification.h): a surface has one colour per vertex, so a
// wall that became two triangles would lose what is painted on it; this one loses detail of shape
// and colour evenly, its error is known without measuring, and it takes a hundredth of the time.
//
// Cells are counted from the origin, so those of a level lie within those of the next one: a point
// of the children's leaves moves by at most the diagonal of a cell (TileNode::geometric_error),
// however many levels lie between; what is smaller than a cell may lose all its area. A vertex on
// the border of the node is joined with others of the same border alone, so that the surfaces of
// two neighbouring nodes of one level meet there.
//
// children  in the order of the node's; each with a colour per vertex, and without normals
// Returns a mesh without normals; it may be empty. Deterministic, O(n log n), thread-safe.
// kInvalidArgument on a broken mesh, one without colours, or vertices far outside of the node.
Result<TriangleMesh> JoinCells(const TileNode& node, double voxel_size,
                               std::span<const TriangleMesh* const> children);

}  // namespace veduta
