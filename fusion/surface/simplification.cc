// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/simplification.h"

#include <algorithm>
#include <utility>

#include "fusion/surface/edge_collapse.h"
#include "fusion/surface/mesh_check.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr double kFirstShare = 0.8,
                 kNextShare = 0.6;  // of the bound: old vertices near does not mean all is near
constexpr int kAttempts = 5;

double MeanEdge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    sum += (mesh.positions[b] - mesh.positions[a]).norm();
  return sum / static_cast<double>(mesh.triangles.size());
}

// The vertices that triangles name, in their old order.
SimplifiedMesh Compact(const TriangleMesh& mesh,
                       const std::vector<std::array<uint32_t, 3>>& triangles) {
  std::vector<uint32_t> number(mesh.positions.size(), 0);
  for (const auto& triangle : triangles) {
    for (const uint32_t v : triangle) number[v] = 1;
  }
  SimplifiedMesh result;
  for (uint32_t v = 0; v < number.size(); ++v) {
    if (number[v] == 0) continue;
    number[v] = static_cast<uint32_t>(result.source_vertex.size());
    result.source_vertex.push_back(v);
    result.mesh.positions.push_back(mesh.positions[v]);
    if (!mesh.normals.empty()) result.mesh.normals.push_back(mesh.normals[v]);
    if (!mesh.colors.empty()) result.mesh.colors.push_back(mesh.colors[v]);
  }
  for (const auto& [a, b, c] : triangles)
    result.mesh.triangles.push_back({number[a], number[b], number[c]});
  return result;
}

}  // namespace

Result<SimplifiedMesh> Simplify(const TriangleMesh& mesh, const SimplificationOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckMesh(mesh));
  if (mesh.triangles.empty()) return SimplifiedMesh();
  const double spacing = std::max(MeanEdge(mesh), 1e-30);
  double bound = kFirstShare * options.distance_max;
  for (int attempt = 0; attempt < kAttempts; ++attempt, bound *= kNextShare) {
    SimplifiedMesh result = Compact(mesh, CollapseEdges(mesh, options, bound));
    VEDUTA_ASSIGN_OR_RETURN(const double there, DistanceTo(mesh, result.mesh, spacing));
    if (there > options.distance_max) continue;
    VEDUTA_ASSIGN_OR_RETURN(const double back, DistanceTo(result.mesh, mesh, spacing));
    if (back > options.distance_max) continue;
    result.distance = std::max(there, back);
    return result;
  }
  return Compact(mesh, mesh.triangles);  // nothing can be left out within the bound
}

}  // namespace veduta
