// SPDX-License-Identifier: Apache-2.0
// Goal: a simplified surface has far fewer triangles and lies as near as was asked, both ways;
//   borders of tiles and colours stay.
// Method: sheets, spheres and tiles simplified under several bounds; distances measured by
//   trying every triangle.
#include "fusion/surface/simplification.h"

#include <limits>

#include "fusion/surface/nearest_point.h"
#include "fusion/surface/vertex_weld.h"
#include "tests/fusion/surface/sample_surfaces.h"

namespace veduta {
namespace {

double DistanceByTrying(const Eigen::Vector3d& place, const TriangleMesh& mesh) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d nearest =
        NearestOnTriangle(place, mesh.positions[a].cast<double>(), mesh.positions[b].cast<double>(),
                          mesh.positions[c].cast<double>());
    least = std::min(least, (nearest - place).norm());
  }
  return least;
}

// Random places on triangles of `from`.
double SampledDistance(const TriangleMesh& from, const TriangleMesh& to, int samples) {
  SeededRandom random(5);
  double greatest = 0;
  for (int i = 0; i < samples; ++i) {
    const auto& [a, b, c] =
        from.triangles[random.Below(static_cast<uint32_t>(from.triangles.size()))];
    double u = random.Unit(), v = random.Unit();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Eigen::Vector3d place = (1 - u - v) * from.positions[a].cast<double>() +
                                  u * from.positions[b].cast<double>() +
                                  v * from.positions[c].cast<double>();
    greatest = std::max(greatest, DistanceByTrying(place, to));
  }
  return greatest;
}

TriangleMesh RoughSheet(double amplitude) {
  SeededRandom random(2);
  return Sheet(50, 40, 0.1, [&](double x, double y) {
    return 0.4 * std::sin(1.5 * x) * std::cos(y) + amplitude * (2 * random.Unit() - 1);
  });
}

SimplificationOptions Within(double distance) {
  SimplificationOptions options;
  options.distance_max = distance;
  return options;
}

TEST(Simplification, StaysWithinTheBoundBothWays) {
  size_t last = std::numeric_limits<size_t>::max();
  for (const double bound : {0.008, 0.02, 0.06}) {
    for (const TriangleMesh& mesh : {RoughSheet(0.003), Sphere({1, 2, 3}, 1.5, 24)}) {
      const SimplifiedMesh small = Simplify(mesh, Within(bound)).value();
      EXPECT_LE(small.distance, bound);
      EXPECT_LE(SampledDistance(mesh, small.mesh, 400), bound * 1.05);
      EXPECT_LE(SampledDistance(small.mesh, mesh, 400), bound * 1.05);
      EXPECT_LT(small.mesh.triangles.size(), mesh.triangles.size());
    }
    const size_t now = Simplify(RoughSheet(0.003), Within(bound)).value().mesh.triangles.size();
    EXPECT_LT(now, last);
    last = now;
  }
  EXPECT_LT(last, 4000u / 5);
}

TEST(Simplification, APlaneNeedsHardlyAnything) {
  const TriangleMesh plane = FlatSheet(40, 40, 0.1);
  SimplificationOptions options = Within(0.01);
  options.keep_border = false;
  const SimplifiedMesh small = Simplify(plane, options).value();
  EXPECT_LE(small.mesh.triangles.size(), 40u);
  double area = 0;
  for (const auto& [a, b, c] : small.mesh.triangles) {
    const Eigen::Vector3f& p = small.mesh.positions[a];
    const Eigen::Vector3f normal = (small.mesh.positions[b] - p).cross(small.mesh.positions[c] - p);
    EXPECT_GT(normal.z(), 0);
    area += 0.5 * normal.norm();
  }
  EXPECT_NEAR(area, 16, 0.1);
}

TEST(Simplification, VerticesKeepTheirPlaceNormalAndColour) {
  TriangleMesh mesh = RoughSheet(0.01);
  for (size_t v = 0; v < mesh.positions.size(); ++v) {
    const uint8_t left =
        mesh.positions[v].x() < 2.5f ? 20 : 220;  // two colours: none may cross the line
    mesh.colors.push_back({left, 100, 100});
  }
  const SimplifiedMesh small = Simplify(mesh, Within(0.05)).value();
  ASSERT_EQ(small.source_vertex.size(), small.mesh.positions.size());
  ASSERT_TRUE(std::is_sorted(small.source_vertex.begin(), small.source_vertex.end()));
  for (size_t v = 0; v < small.source_vertex.size(); ++v) {
    EXPECT_EQ(small.mesh.positions[v], mesh.positions[small.source_vertex[v]]);
    EXPECT_EQ(small.mesh.normals[v], mesh.normals[small.source_vertex[v]]);
    EXPECT_EQ(small.mesh.colors[v], mesh.colors[small.source_vertex[v]]);
  }
  // A triangle of both colours is at the line and was not stretched away from it.
  for (const auto& [a, b, c] : small.mesh.triangles) {
    if (small.mesh.colors[a] == small.mesh.colors[b] &&
        small.mesh.colors[b] == small.mesh.colors[c])
      continue;
    for (const uint32_t v : {a, b, c}) EXPECT_NEAR(small.mesh.positions[v].x(), 2.5, 1.0);
  }
  EXPECT_LT(small.mesh.triangles.size(), 1000u);
}

TEST(Simplification, TilesStillFitTogether) {
  const TriangleMesh whole = RoughSheet(0.01);
  VertexWeld weld;
  TriangleMesh joined;
  size_t triangles = 0;
  for (const Tile& tile : CutIntoTiles(whole, 1.3)) {
    const SimplifiedMesh small = Simplify(tile.mesh, Within(0.05)).value();
    std::vector<uint64_t> keys;
    for (const uint32_t v : small.source_vertex) keys.push_back(tile.keys[v]);
    // Every border vertex of the tile is still there.
    const std::vector<uint8_t> is_border = BorderVertices(tile.mesh);
    for (size_t v = 0; v < is_border.size(); ++v) {
      const bool is_there =
          std::binary_search(small.source_vertex.begin(), small.source_vertex.end(), v);
      EXPECT_TRUE(is_there || !is_border[v]);
    }
    const VertexWeld::Piece piece = weld.Add(small.mesh, keys);
    for (const uint32_t v : piece.new_vertices) joined.positions.push_back(small.mesh.positions[v]);
    joined.triangles.insert(joined.triangles.end(), piece.triangles.begin(), piece.triangles.end());
    triangles += tile.mesh.triangles.size();
  }
  EXPECT_LT(joined.triangles.size(), triangles / 2);
  // No crack: what is left of a border is the sheet's own.
  const std::vector<uint8_t> is_border = BorderVertices(joined);
  for (size_t v = 0; v < is_border.size(); ++v) {
    if (!is_border[v]) continue;
    const Eigen::Vector3f& x = joined.positions[v];
    EXPECT_TRUE(x.x() == 0 || x.y() == 0 || x.x() > 4.999f || x.y() > 3.999f) << x.transpose();
  }
}

TEST(Simplification, WhatNoManifoldHoldsStays) {
  TriangleMesh mesh = FlatSheet(10, 10, 0.1);
  const uint32_t fin = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.push_back({0.55f, 0.5f, 0.4f});
  mesh.triangles.push_back({60, 61, fin});  // a third triangle at an inner edge
  mesh.triangles.push_back({7, 7, 8});      // none at all
  mesh.normals.clear();
  const SimplifiedMesh small = Simplify(mesh, Within(0.02)).value();
  EXPECT_EQ(small.source_vertex.back(), fin);
  EXPECT_LT(small.mesh.triangles.size(), 120u);
  EXPECT_LE(SampledDistance(mesh, small.mesh, 300), 0.02);
}

TEST(Simplification, SaysWhatIsWrong) {
  EXPECT_TRUE(Simplify({}, Within(1)).value().mesh.triangles.empty());
  EXPECT_EQ(Simplify({}, Within(0)).status().code(), StatusCode::kInvalidArgument);
  TriangleMesh mesh = FlatSheet(2, 2, 1);
  mesh.triangles[0][0] = 100;
  EXPECT_EQ(Simplify(mesh, Within(1)).status().code(), StatusCode::kInvalidArgument);
  mesh = FlatSheet(2, 2, 1);
  mesh.positions[0].z() = std::numeric_limits<float>::infinity();
  EXPECT_EQ(Simplify(mesh, Within(1)).status().code(), StatusCode::kInvalidArgument);
}

TEST(NearestPoint, NothingOnTheTriangleIsNearer) {
  SeededRandom random(8);
  const auto point = [&]() -> Eigen::Vector3d {
    return 2 * Eigen::Vector3d{random.Unit(), random.Unit(), random.Unit()} -
           Eigen::Vector3d::Ones();
  };
  for (int round = 0; round < 300; ++round) {
    const Eigen::Vector3d p = 1.5 * point(), a = point();
    Eigen::Vector3d b = point(), c = point();
    if (round % 10 == 1) c = b;                  // a segment
    if (round % 10 == 2) c = 0.3 * a + 0.7 * b;  // a segment, too
    if (round % 10 == 3) b = c = a;              // a point
    const double distance = (NearestOnTriangle(p, a, b, c) - p).norm();
    double least = std::numeric_limits<double>::infinity();
    constexpr int kSteps = 60;
    for (int u = 0; u <= kSteps; ++u) {
      for (int v = 0; u + v <= kSteps; ++v) {
        least = std::min(least, (a + (b - a) * u / kSteps + (c - a) * v / kSteps - p).norm());
      }
    }
    ASSERT_LE(distance, least + 1e-12) << round;
    ASSERT_GT(distance, least - 0.05) << round;  // and it is on the triangle
  }
}

TEST(MeshDistance, AgreesWithEveryTriangleTried) {
  const TriangleMesh soup = Soup(60, 0.3, 9), sphere = Sphere({0, 0, 0}, 0.8, 8);
  double greatest = 0;
  for (const auto& [a, b, c] : sphere.triangles) {
    const Eigen::Vector3d p = sphere.positions[a].cast<double>(),
                          q = sphere.positions[b].cast<double>();
    const Eigen::Vector3d r = sphere.positions[c].cast<double>();
    for (const Eigen::Vector3d& place : std::vector<Eigen::Vector3d>{
             p, q, r, (p + q) / 2, (q + r) / 2, (p + r) / 2, (p + q + r) / 3}) {
      greatest = std::max(greatest, DistanceByTrying(place, soup));
    }
  }
  EXPECT_NEAR(DistanceTo(sphere, soup, 10).value(), greatest, 1e-6);
  EXPECT_GE(DistanceTo(sphere, soup, 0.02).value(), greatest - 1e-9);
  EXPECT_EQ(DistanceTo({}, soup, 1).value(), 0);
  EXPECT_EQ(DistanceTo(soup, {}, 1).value(), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(DistanceTo(soup, soup, 0).ok());
}

}  // namespace
}  // namespace veduta
