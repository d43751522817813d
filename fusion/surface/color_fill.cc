// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/color_fill.h"

#include <utility>

namespace veduta {
namespace {

// The vertices that share a triangle with each vertex; one that shares two appears twice, and
// counts twice.
struct Adjacency {
  std::vector<uint32_t> first;  // [vertices + 1]
  std::vector<uint32_t> neighbors;
};

Adjacency Neighbors(const TriangleMesh& mesh) {
  Adjacency adjacency;
  adjacency.first.assign(mesh.positions.size() + 1, 0);
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t v : triangle) adjacency.first[v + 1] += 2;
  }
  for (size_t v = 0; v < mesh.positions.size(); ++v) adjacency.first[v + 1] += adjacency.first[v];
  adjacency.neighbors.resize(mesh.triangles.size() * 6);
  std::vector<uint32_t> next(adjacency.first.begin(), adjacency.first.end() - 1);
  for (const auto& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      adjacency.neighbors[next[triangle[k]]++] = triangle[(k + 1) % 3];
      adjacency.neighbors[next[triangle[k]]++] = triangle[(k + 2) % 3];
    }
  }
  return adjacency;
}

}  // namespace

void FillColors(const TriangleMesh& mesh, uint32_t rings_max, std::vector<Eigen::Vector3f>* light,
                std::vector<uint8_t>* is_known) {
  const Adjacency adjacency = Neighbors(mesh);
  const auto neighbors = [&](uint32_t v) {
    return std::pair(adjacency.neighbors.data() + adjacency.first[v],
                     adjacency.neighbors.data() + adjacency.first[v + 1]);
  };
  std::vector<uint32_t> front;  // known since the last ring
  for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
    if ((*is_known)[v]) front.push_back(v);
  }
  std::vector<uint8_t> is_listed(mesh.positions.size());
  for (uint32_t ring = 0; ring < rings_max && !front.empty(); ++ring) {
    std::vector<uint32_t> ahead;
    for (const uint32_t v : front) {
      const auto [begin, end] = neighbors(v);
      for (const uint32_t* n = begin; n != end; ++n) {
        if (!(*is_known)[*n] && !is_listed[*n]) is_listed[*n] = 1, ahead.push_back(*n);
      }
    }
    for (const uint32_t v : ahead) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float count = 0;
      const auto [begin, end] = neighbors(v);
      for (const uint32_t* n = begin; n != end; ++n) {
        if ((*is_known)[*n]) sum += (*light)[*n], ++count;
      }
      (*light)[v] = sum / count;
    }
    for (const uint32_t v : ahead) (*is_known)[v] = 1;
    front = std::move(ahead);
  }
}

}  // namespace veduta
