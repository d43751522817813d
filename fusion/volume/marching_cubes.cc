// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/marching_cubes.h"

#include <string>

#include "storage/base/status.h"

namespace veduta {
namespace {

int EdgeBetween(int a, int b) {
  const auto& edges = CellEdges();
  for (int e = 0; e < kCellEdges; ++e) {
    const int low = edges[e].corner, high = low | 1 << edges[e].axis;
    if ((low == a && high == b) || (low == b && high == a)) return e;
  }
  AbortWithMessage(__FILE__, __LINE__,
                   "corners " + std::to_string(a) + " and " + std::to_string(b) + " share no edge");
}

// The corners of a face counter-clockwise as seen from outside the cell.
std::array<int, 4> FaceCorners(int axis, int side) {
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

// The faces that an edge lies on, a bit each.
uint32_t FacesOfEdge(int edge) {
  const CellEdge& e = CellEdges()[edge];
  uint32_t faces = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != e.axis) faces |= 1u << (2 * axis + (e.corner >> axis & 1));
  }
  return faces;
}

// For each crossed edge the one that follows it on its loop; -1 elsewhere. Walking around a face,
// the crossing that leaves matter is joined to the one before it, that entered: matter is kept
// apart where a face has four crossings.
std::array<int, kCellEdges> FollowingEdges(uint8_t inside) {
  std::array<int, kCellEdges> following;
  following.fill(-1);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corners = FaceCorners(face / 2, face % 2);
    const auto is_inside = [&](int i) { return (inside >> corners[i & 3] & 1) != 0; };
    for (int i = 0; i < 4; ++i) {
      if (!is_inside(i) || is_inside(i + 1)) continue;
      int entered = i + 3;  // corners[entered] -> corners[entered + 1] enters matter
      while (is_inside(entered)) entered += 3;
      following[EdgeBetween(corners[i], corners[(i + 1) & 3])] =
          EdgeBetween(corners[entered & 3], corners[(entered + 1) & 3]);
    }
  }
  return following;
}

// Cuts loop[first..last] (closed by the chord from last to first) into triangles without a chord on
// a face.
bool Triangulate(const std::vector<int>& loop, size_t first, size_t last,
                 CellTriangles* triangles) {
  if (last - first < 2) return true;
  const auto is_allowed = [&](size_t a, size_t b) {
    const bool neighbors = b - a == 1 || (a == 0 && b + 1 == loop.size());
    return neighbors || (FacesOfEdge(loop[a]) & FacesOfEdge(loop[b])) == 0;
  };
  for (size_t middle = first + 1; middle < last; ++middle) {
    if (!is_allowed(first, middle) || !is_allowed(middle, last)) continue;
    const size_t count = triangles->size();
    triangles->push_back({static_cast<uint8_t>(loop[first]), static_cast<uint8_t>(loop[last]),
                          static_cast<uint8_t>(loop[middle])});
    if (Triangulate(loop, first, middle, triangles) && Triangulate(loop, middle, last, triangles))
      return true;
    triangles->resize(count);
  }
  return false;
}

CellTriangles MakeTriangles(uint8_t inside) {
  std::array<int, kCellEdges> following = FollowingEdges(inside);
  CellTriangles triangles;
  for (int start = 0; start < kCellEdges; ++start) {
    std::vector<int> loop;
    for (int edge = start; following[edge] >= 0;) {
      loop.push_back(edge);
      const int next = following[edge];
      following[edge] = -1;
      edge = next;
    }
    if (loop.empty()) continue;
    VEDUTA_CHECK(Triangulate(loop, 0, loop.size() - 1, &triangles),
                 "case " + std::to_string(inside));
  }
  return triangles;
}

}  // namespace

const std::array<CellEdge, kCellEdges>& CellEdges() {
  static const std::array<CellEdge, kCellEdges> edges = [] {
    std::array<CellEdge, kCellEdges> made;
    int count = 0;
    for (int axis = 0; axis < 3; ++axis) {
      for (int corner = 0; corner < kCellCorners; ++corner) {
        if ((corner >> axis & 1) == 0) made[count++] = {corner, axis};
      }
    }
    return made;
  }();
  return edges;
}

const CellTriangles& TrianglesOfCell(uint8_t inside) {
  static const std::array<CellTriangles, 256> table = [] {
    std::array<CellTriangles, 256> made;
    for (int i = 0; i < 256; ++i) made[i] = MakeTriangles(static_cast<uint8_t>(i));
    return made;
  }();
  return table[inside];
}

}  // namespace veduta
