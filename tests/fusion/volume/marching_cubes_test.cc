// SPDX-License-Identifier: Apache-2.0
// Goal: the triangles of cells are closed surfaces, whatever the corners: no crack, no edge
//   with three triangles, all turned outwards.
// Method: each of the 256 cases alone; then seeded random corners on a grid, where all
//   ambiguous faces meet, count the triangles at every edge.
#include "fusion/volume/marching_cubes.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <map>
#include <set>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

TEST(MarchingCubes, UsesEveryCrossedEdgeAndNoOther) {
  for (int inside = 0; inside < 256; ++inside) {
    std::set<int> used, crossed;
    for (const auto& triangle : TrianglesOfCell(static_cast<uint8_t>(inside)))
      used.insert(triangle.begin(), triangle.end());
    for (int e = 0; e < kCellEdges; ++e) {
      const int low = CellEdges()[e].corner, high = low | 1 << CellEdges()[e].axis;
      if ((inside >> low & 1) != (inside >> high & 1)) crossed.insert(e);
    }
    EXPECT_EQ(used, crossed) << inside;
  }
}

TEST(MarchingCubes, TurnsTrianglesTowardsFreeSpace) {
  for (int corner = 0; corner < kCellCorners; ++corner) {
    for (const bool is_hole : {false, true}) {
      const auto inside = static_cast<uint8_t>(is_hole ? 255 ^ 1 << corner : 1 << corner);
      ASSERT_EQ(TrianglesOfCell(inside).size(), 1u);
      Eigen::Vector3d points[3];
      for (int i = 0; i < 3; ++i) {
        const CellEdge& edge = CellEdges()[TrianglesOfCell(inside)[0][i]];
        points[i] = {double(edge.corner & 1), double(edge.corner >> 1 & 1),
                     double(edge.corner >> 2 & 1)};
        points[i][edge.axis] += 0.5;
      }
      const Eigen::Vector3d at(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      const double away = (points[1] - points[0]).cross(points[2] - points[0]).dot(points[0] - at);
      EXPECT_GT(is_hole ? -away : away, 0) << corner;
    }
  }
}

TEST(MarchingCubes, ClosesOverRandomCorners) {
  constexpr int kSide = 24;
  SeededRandom random(5);
  for (const uint32_t share : {2, 3, 6}) {
    std::vector<bool> matter(kSide * kSide * kSide);
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const int x = i % kSide, y = i / kSide % kSide, z = i / (kSide * kSide);
      const bool border = std::min({x, y, z}) == 0 || std::max({x, y, z}) == kSide - 1;
      matter[i] = !border && random.Below(share) == 0;
    }
    std::map<std::pair<int, int>, int> edges;  // directed
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const int x = i % kSide, y = i / kSide % kSide, z = i / (kSide * kSide);
      if (std::max({x, y, z}) == kSide - 1) continue;
      const auto corner_at = [&](int c) {
        return i + (c & 1) + (c >> 1 & 1) * kSide + (c >> 2 & 1) * kSide * kSide;
      };
      uint8_t inside = 0;
      for (int c = 0; c < kCellCorners; ++c)
        inside |= static_cast<uint8_t>(matter[corner_at(c)] << c);
      for (const auto& t : TrianglesOfCell(inside)) {
        int vertex[3];
        for (int k = 0; k < 3; ++k)
          vertex[k] = 3 * corner_at(CellEdges()[t[k]].corner) + CellEdges()[t[k]].axis;
        for (int k = 0; k < 3; ++k) ++edges[{vertex[k], vertex[(k + 1) % 3]}];
      }
    }
    ASSERT_GT(edges.size(), 1000u);
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1);
      ASSERT_EQ(edges.count({edge.second, edge.first}), 1u);
    }
  }
}

}  // namespace
}  // namespace veduta
