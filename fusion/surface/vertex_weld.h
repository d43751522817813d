// SPDX-License-Identifier: Apache-2.0
#pragma once
// One numbering of the vertices of many pieces of a surface.

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "storage/model/triangle_mesh.h"

namespace veduta {

// Two pieces that share a vertex both have it on their border (a vertex whose triangles are all in
// one piece is shared with nobody), so keys are remembered for vertices on borders alone: memory
// follows the borders, not the surface.
class VertexWeld final {
 public:
  struct Piece {
    std::vector<uint32_t> new_vertices;  // of the piece, in ascending order: those to be written
    std::vector<std::array<uint32_t, 3>> triangles;  // in the numbering of all pieces
  };

  // mesh must pass CheckMesh; keys: one for each vertex, or none. Vertices get ascending numbers as
  // they come. Vertices of no triangle and triangles that name a vertex twice, also after welding,
  // are left out. O(n log n) of the piece.
  Piece Add(const TriangleMesh& mesh, std::span<const uint64_t> keys);

  uint64_t vertex_count() const { return vertex_count_; }

 private:
  std::unordered_map<uint64_t, uint32_t> border_;
  uint64_t vertex_count_ = 0;
};

// Whether each vertex lies on an edge of exactly one triangle. O(n log n).
std::vector<uint8_t> BorderVertices(const TriangleMesh& mesh);

}  // namespace veduta
