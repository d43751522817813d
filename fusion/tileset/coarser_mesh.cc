// SPDX-License-Identifier: Apache-2.0
#include "fusion/tileset/coarser_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "fusion/surface/color_view.h"
#include "fusion/surface/mesh_check.h"
#include "fusion/volume/grid.h"

namespace veduta {
namespace {

// Vertices on borders lie on planes through middles of voxels, all others at least a sixty-fourth
// of a voxel away from these (kInterpolationMin of fusion/volume/extraction.cc). Floats tell the
// two apart up to some 100,000 voxels from the origin.
constexpr double kOnBorderVoxels = 0.01;
// Cells of a node along an axis, with those of a root that reaches to both sides of the origin, and
// one for the far border: [-64, 64].
constexpr int64_t kCellMax = kTileSide;

// Cell and borders of a vertex as one number: vertices of one number are joined.
class CellKeys final {
 public:
  CellKeys(const TileNode& node, double voxel_size)
      : voxel_size_(voxel_size), cell_voxels_(std::ldexp(1.0, static_cast<int>(node.level))) {
    const std::array<int32_t, 3> place = {node.place.x, node.place.y, node.place.z};
    for (int axis = 0; axis < 3; ++axis) first_[axis] = int64_t{place[axis]} * kTileSide;
  }

  // False where the vertex is far outside of the node.
  bool Find(const Eigen::Vector3f& position, uint32_t* key) const {
    *key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double cells = (double{position[axis]} / voxel_size_ - 0.5) / cell_voxels_;
      const double whole = std::round(cells);
      const double low = static_cast<double>(first_[axis]), high = low + kTileSide;
      const bool is_border = (whole == low || whole == high) &&
                             std::abs(cells - whole) * cell_voxels_ < kOnBorderVoxels;
      const double cell = (is_border ? whole : std::floor(cells)) - low;
      if (!(std::abs(cell) <= kCellMax)) return false;
      *key = *key << 9 | static_cast<uint32_t>(cell + kCellMax) << 1 | (is_border ? 1u : 0u);
    }
    return true;
  }

 private:
  const double voxel_size_, cell_voxels_;
  std::array<int64_t, 3> first_{};  // cells
};

// The mean of what is joined.
class Mean final {
 public:
  void Add(const Eigen::Vector3f& position, const std::array<uint8_t, 3>& rgb) {
    place_ += position.cast<double>();
    for (int c = 0; c < 3; ++c) light_[c] += double{LightFromSrgb(rgb[c])};
    count_ += 1;
  }
  Eigen::Vector3f place() const { return (place_ / count_).cast<float>(); }
  std::array<uint8_t, 3> rgb() const {
    std::array<uint8_t, 3> rgb{};
    for (int c = 0; c < 3; ++c) rgb[c] = SrgbFromLight(static_cast<float>(light_[c] / count_));
    return rgb;
  }

 private:
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero(), light_ = Eigen::Vector3d::Zero();
  double count_ = 0;
};

// A vertex of a child and the number that it is joined by.
struct KeyedVertex {
  uint32_t key;
  uint32_t child, vertex;
  auto operator<=>(const KeyedVertex&) const = default;
};

Result<std::vector<KeyedVertex>> SortByCell(const CellKeys& keys,
                                            std::span<const TriangleMesh* const> children) {
  std::vector<KeyedVertex> vertices;
  for (uint32_t child = 0; child < children.size(); ++child) {
    const TriangleMesh& mesh = *children[child];
    VEDUTA_RETURN_IF_ERROR(CheckMesh(mesh));
    if (mesh.colors.size() != mesh.positions.size())
      return Status::InvalidArgument("a tile's surface has no colours");
    for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
      KeyedVertex& keyed = vertices.emplace_back(KeyedVertex{0, child, v});
      if (!keys.Find(mesh.positions[v], &keyed.key))
        return Status::InvalidArgument("vertex " + std::to_string(v) +
                                       " of a tile lies far outside of it");
    }
  }
  std::ranges::sort(vertices);
  return vertices;
}

// Without those that have no area, each once, the lowest vertex first.
std::vector<std::array<uint32_t, 3>> JoinedTriangles(
    std::span<const TriangleMesh* const> children,
    const std::vector<std::vector<uint32_t>>& number) {
  std::vector<std::array<uint32_t, 3>> triangles;
  for (size_t child = 0; child < children.size(); ++child) {
    for (const auto& [a, b, c] : children[child]->triangles) {
      std::array<uint32_t, 3> joined = {number[child][a], number[child][b], number[child][c]};
      if (joined[0] == joined[1] || joined[1] == joined[2] || joined[2] == joined[0]) continue;
      std::rotate(joined.begin(), std::ranges::min_element(joined), joined.end());
      triangles.push_back(joined);
    }
  }
  std::ranges::sort(triangles);
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

}  // namespace

Result<TriangleMesh> JoinCells(const TileNode& node, double voxel_size,
                               std::span<const TriangleMesh* const> children) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<KeyedVertex> vertices,
                          SortByCell(CellKeys(node, voxel_size), children));
  std::vector<std::vector<uint32_t>> number(children.size());
  for (size_t child = 0; child < children.size(); ++child)
    number[child].resize(children[child]->positions.size());
  std::vector<Mean> means;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const auto& [key, child, vertex] = vertices[i];
    if (i == 0 || key != vertices[i - 1].key) means.emplace_back();
    means.back().Add(children[child]->positions[vertex], children[child]->colors[vertex]);
    number[child][vertex] = static_cast<uint32_t>(means.size() - 1);
  }
  TriangleMesh mesh;
  mesh.triangles = JoinedTriangles(children, number);
  constexpr uint32_t kUnused = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> place(means.size(), kUnused);
  for (auto& triangle : mesh.triangles) {
    for (uint32_t& v : triangle) {
      if (place[v] == kUnused) {
        place[v] = static_cast<uint32_t>(mesh.positions.size());
        mesh.positions.push_back(means[v].place());
        mesh.colors.push_back(means[v].rgb());
      }
      v = place[v];
    }
  }
  return mesh;
}

}  // namespace veduta
