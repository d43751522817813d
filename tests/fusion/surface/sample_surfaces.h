// SPDX-License-Identifier: Apache-2.0
#pragma once
// Small surfaces of known shape, whole and cut into tiles, and cameras before them.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fusion/surface/mesh_check.h"
#include "fusion/surface/ray_scene.h"
#include "fusion/surface/renderer.h"
#include "storage/base/content_hash.h"
#include "storage/model/view.h"

namespace veduta {

// A folder that goes with the test.
class SampleFolder final {
 public:
  explicit SampleFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() /
              ("veduta_surface_" + std::to_string(getpid()) + "_" + name)) {
    std::filesystem::create_directories(path_);
  }
  ~SampleFolder() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  size_t file_count() const {
    return static_cast<size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

// z = height(x, y) over [0, columns * step] x [0, rows * step], seen from +z.
inline TriangleMesh Sheet(uint32_t columns, uint32_t rows, double step,
                          const std::function<double(double, double)>& height) {
  TriangleMesh mesh;
  for (uint32_t j = 0; j <= rows; ++j) {
    for (uint32_t i = 0; i <= columns; ++i) {
      const double x = i * step, y = j * step;
      mesh.positions.push_back(Eigen::Vector3d(x, y, height(x, y)).cast<float>());
    }
  }
  for (uint32_t j = 0; j < rows; ++j) {
    for (uint32_t i = 0; i < columns; ++i) {
      const uint32_t a = j * (columns + 1) + i, b = a + 1, c = a + columns + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  mesh.normals = VertexNormals(mesh);
  return mesh;
}

inline TriangleMesh FlatSheet(uint32_t columns, uint32_t rows, double step) {
  return Sheet(columns, rows, step, [](double, double) { return 0.0; });
}

// A closed sphere of rings and sectors.
inline TriangleMesh Sphere(const Eigen::Vector3d& center, double radius, uint32_t rings) {
  TriangleMesh mesh;
  const uint32_t sectors = 2 * rings;
  const auto at = [&](double polar, double around) {
    const Eigen::Vector3d n(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                            std::cos(polar));
    mesh.positions.push_back((center + radius * n).cast<float>());
    mesh.normals.push_back(n.cast<float>());
  };
  at(0, 0);
  for (uint32_t r = 1; r < rings; ++r) {
    for (uint32_t s = 0; s < sectors; ++s) at(M_PI * r / rings, 2 * M_PI * s / sectors);
  }
  at(M_PI, 0);
  const uint32_t last = static_cast<uint32_t>(mesh.positions.size() - 1);
  const auto index = [&](uint32_t r, uint32_t s) { return 1 + (r - 1) * sectors + s % sectors; };
  for (uint32_t s = 0; s < sectors; ++s) {
    mesh.triangles.push_back({0, index(1, s), index(1, s + 1)});
    mesh.triangles.push_back({last, index(rings - 1, s + 1), index(rings - 1, s)});
    for (uint32_t r = 1; r + 1 < rings; ++r) {
      mesh.triangles.push_back({index(r, s), index(r + 1, s), index(r + 1, s + 1)});
      mesh.triangles.push_back({index(r, s), index(r + 1, s + 1), index(r, s + 1)});
    }
  }
  return mesh;
}

// Every triangle on its own, anywhere in [-1, 1]^3.
inline TriangleMesh Soup(uint32_t count, double size, uint64_t seed) {
  SeededRandom random(seed);
  TriangleMesh mesh;
  const auto unit = [&] { return 2 * random.Unit() - 1; };
  for (uint32_t i = 0; i < count; ++i) {
    const Eigen::Vector3d middle(unit(), unit(), unit());
    for (int k = 0; k < 3; ++k) {
      mesh.positions.push_back(
          (middle + size * Eigen::Vector3d(unit(), unit(), unit())).cast<float>());
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  mesh.normals = VertexNormals(mesh);
  return mesh;
}

struct Tile {
  TriangleMesh mesh;
  std::vector<uint64_t> keys;  // the vertex in the whole mesh
};

// Cuts a mesh into tiles of columns `width` wide along x and y, by the middles of triangles:
// borders are jagged.
inline std::vector<Tile> CutIntoTiles(const TriangleMesh& whole, double width) {
  std::map<std::pair<int, int>, Tile> tiles;
  std::map<std::pair<int, int>, std::map<uint32_t, uint32_t>> numbers;
  for (const auto& triangle : whole.triangles) {
    const Eigen::Vector3f middle = (whole.positions[triangle[0]] + whole.positions[triangle[1]] +
                                    whole.positions[triangle[2]]) /
                                   3;
    const auto cell = std::pair(static_cast<int>(std::floor(middle.x() / width)),
                                static_cast<int>(std::floor(middle.y() / width)));
    Tile& tile = tiles[cell];
    std::array<uint32_t, 3> own;
    for (int k = 0; k < 3; ++k) {
      const uint32_t v = triangle[k];
      const auto [it, is_new] =
          numbers[cell].try_emplace(v, static_cast<uint32_t>(tile.keys.size()));
      own[k] = it->second;
      if (!is_new) continue;
      tile.keys.push_back(v);
      tile.mesh.positions.push_back(whole.positions[v]);
      if (!whole.normals.empty()) tile.mesh.normals.push_back(whole.normals[v]);
      if (!whole.colors.empty()) tile.mesh.colors.push_back(whole.colors[v]);
    }
    tile.mesh.triangles.push_back(own);
  }
  std::vector<Tile> list;
  for (auto& [cell, tile] : tiles) list.push_back(std::move(tile));
  return list;
}

inline Eigen::AlignedBox3d BoxOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& x : mesh.positions) box.extend(x.cast<double>());
  return box;
}

inline std::shared_ptr<const RayDevice> SampleDevice() {
  static const std::shared_ptr<const RayDevice> device = RayDevice::Open().value();
  return device;
}

inline std::shared_ptr<const RayScene> SceneOf(const std::vector<TriangleMesh>& meshes) {
  std::vector<std::shared_ptr<const RayTile>> tiles;
  for (const TriangleMesh& mesh : meshes)
    tiles.push_back(RayTile::Make(SampleDevice(), mesh).value());
  return RayScene::Make(SampleDevice(), std::move(tiles)).value();
}

// Where the ray meets the triangle, counted in the direction's length; negative: nowhere. Cramer's
// rule.
inline double MeetTriangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                           const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                           const Eigen::Vector3d& c) {
  Eigen::Matrix3d m;
  m << b - a, c - a, -direction;
  if (std::abs(m.determinant()) < 1e-15) return -1;
  const Eigen::Vector3d x = m.inverse() * (origin - a);
  return x[0] >= 0 && x[1] >= 0 && x[0] + x[1] <= 1 ? x[2] : -1;
}

inline bool EqualPictures(const Picture& a, const Picture& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.rgb == b.rgb &&
         a.depth == b.depth;
}

}  // namespace veduta
