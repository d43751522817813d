// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tiles of a surface as an octree: what viewers draw from afar and from near.
//
// 1. A leaf is a tile of the volume (fusion/volume/grid.h) that has triangles, as it is.
// 2. A node of level L holds 2^L tiles along each axis, of places that are a multiple of 2^L, so
//    that the tree of a city that grows keeps its nodes. Its surface is that of its children with
//    the vertices of each cell of 2^L voxels joined (coarser_mesh.h), so it has about as many
//    triangles as a leaf, and no point of it is further than the cell's diagonal from where it was.
// 3. Up to eight nodes of one level around the origin have no common multiple: the root joins them.
// 4. A node's version is a hash of all that its surface is made from. Its name has it, so a name
//    stands for the same bytes for ever.

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/grid_place.h"

namespace veduta {

// Raise it whenever a change of the code changes the bytes that a name stands for.
inline constexpr uint32_t kTilesetVersion = 1;

// A tile that has triangles.
struct TileLeaf {
  GridPlace place;
  uint64_t blocks = 0;   // bit x + 4 y + 16 z: that block is allocated; not 0
  uint64_t version = 0;  // of its mesh and colours
};

struct TileNode {
  uint32_t level = 0;
  GridPlace place;             // of its lowest tile, divided by 2^level; (0, 0, 0) of such a root
  uint64_t version = 0;        // of its surface
  Eigen::AlignedBox3d box;     // holds its surface; frame of the reconstruction
  double geometric_error = 0;  // bound of the distance to the leaves' surface; 0 of a leaf
  std::vector<uint32_t> children;  // numbers of nodes, ascending places; none of a leaf
};

// Immutable.
class TileTree final {
 public:
  // Leaves of ascending places, each once. O(n log n). kInvalidArgument on a bad voxel size, leaves
  // out of order, without blocks, or so far out that the grid has no such block.
  static Result<TileTree> Make(std::span<const TileLeaf> leaves, double voxel_size);

  // Leaves first, in their order; then level by level; the root is the last one. None without
  // leaves.
  const std::vector<TileNode>& nodes() const { return nodes_; }
  double voxel_size() const { return voxel_size_; }

 private:
  double voxel_size_ = 0;
  std::vector<TileNode> nodes_;
};

// The version of a leaf's content, and the names of contents: "LEVEL_X_Y_Z_VERSION", the version in
// 16 digits of hexadecimal.
uint64_t LeafVersion(const TileLeaf& leaf, double voxel_size);
std::string TileName(const TileNode& node);

struct ParsedTileName {
  uint32_t level = 0;
  GridPlace place;
  uint64_t version = 0;
};
// Nothing for a text that is no name as TileName makes them.
std::optional<ParsedTileName> ParseTileName(const std::string& name);

}  // namespace veduta
