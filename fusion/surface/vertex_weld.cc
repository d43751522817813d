// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/vertex_weld.h"

#include <algorithm>

namespace veduta {
namespace {

constexpr uint32_t kNone = ~0u;

bool IsDegenerate(const std::array<uint32_t, 3>& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

}  // namespace

std::vector<uint8_t> BorderVertices(const TriangleMesh& mesh) {
  std::vector<uint64_t> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (const auto& triangle : mesh.triangles) {
    if (IsDegenerate(triangle)) continue;
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      edges.push_back(uint64_t{low} << 32 | high);
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<uint8_t> is_border(mesh.positions.size());
  for (size_t i = 0; i < edges.size();) {
    size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    if (end == i + 1) is_border[edges[i] >> 32] = is_border[edges[i] & ~0u] = 1;
    i = end;
  }
  return is_border;
}

VertexWeld::Piece VertexWeld::Add(const TriangleMesh& mesh, std::span<const uint64_t> keys) {
  std::vector<uint8_t> is_used(mesh.positions.size());
  for (const auto& triangle : mesh.triangles) {
    if (IsDegenerate(triangle)) continue;
    for (const uint32_t v : triangle) is_used[v] = 1;
  }
  const std::vector<uint8_t> is_border =
      keys.empty() ? std::vector<uint8_t>() : BorderVertices(mesh);
  std::vector<uint32_t> number(mesh.positions.size(), kNone);
  Piece piece;
  for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
    if (!is_used[v]) continue;
    const uint32_t next = static_cast<uint32_t>(vertex_count_);
    if (!keys.empty() && is_border[v]) {
      const auto [it, is_new] = border_.try_emplace(keys[v], next);
      number[v] = it->second;
      if (!is_new) continue;
    } else {
      number[v] = next;
    }
    ++vertex_count_;
    piece.new_vertices.push_back(v);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (IsDegenerate({a, b, c})) continue;
    const std::array<uint32_t, 3> welded = {number[a], number[b], number[c]};
    if (!IsDegenerate(welded)) piece.triangles.push_back(welded);
  }
  return piece;
}

}  // namespace veduta
