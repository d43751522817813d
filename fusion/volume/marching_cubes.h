// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which triangles a cell holds, by which of its corners lie within matter. Derived, not copied: on
// every face the crossings are joined by one rule (corners within matter are kept apart), the same
// whichever cell looks at the face, so cells fit each other; the segments close to loops; and loops
// are cut by diagonals through the cell's inside only, so that no edge gets more than two
// triangles.

#include <array>
#include <cstdint>
#include <vector>

namespace veduta {

// Corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1).
inline constexpr int kCellCorners = 8, kCellEdges = 12;

struct CellEdge {
  int corner = 0;  // the lower end
  int axis = 0;    // 0: x, 1: y, 2: z; the other end is corner | 1 << axis
};
const std::array<CellEdge, kCellEdges>& CellEdges();

// Three edges of the cell each, counter-clockwise seen from free space.
using CellTriangles = std::vector<std::array<uint8_t, 3>>;

// inside: bit c says whether corner c lies within matter. Thread-safe.
const CellTriangles& TrianglesOfCell(uint8_t inside);

}  // namespace veduta
