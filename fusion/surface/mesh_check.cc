// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/mesh_check.h"

#include <Eigen/Geometry>
#include <limits>
#include <string>

namespace veduta {

Status CheckMesh(const TriangleMesh& mesh) {
  const auto wrong = [](const std::string& text) {
    return Status::InvalidArgument("mesh: " + text);
  };
  const size_t count = mesh.positions.size();
  if (count > std::numeric_limits<int32_t>::max() ||
      mesh.triangles.size() > std::numeric_limits<int32_t>::max()) {
    return wrong("more than 2^31 vertices or triangles; cut it into tiles");
  }
  if (!mesh.normals.empty() && mesh.normals.size() != count) {
    return wrong(std::to_string(mesh.normals.size()) + " normals for " + std::to_string(count) +
                 " positions");
  }
  if (!mesh.colors.empty() && mesh.colors.size() != count) {
    return wrong(std::to_string(mesh.colors.size()) + " colours for " + std::to_string(count) +
                 " positions");
  }
  for (size_t i = 0; i < count; ++i) {
    if (!mesh.positions[i].allFinite())
      return wrong("position " + std::to_string(i) + " is not finite");
  }
  for (size_t i = 0; i < mesh.normals.size(); ++i) {
    if (!mesh.normals[i].allFinite())
      return wrong("normal " + std::to_string(i) + " is not finite");
  }
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const uint32_t vertex : mesh.triangles[i]) {
      if (vertex >= count) {
        return wrong("triangle " + std::to_string(i) + " names vertex " + std::to_string(vertex) +
                     " of " + std::to_string(count));
      }
    }
  }
  return {};
}

std::vector<Eigen::Vector3f> VertexNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> sums(mesh.positions.size(), Eigen::Vector3d::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p = mesh.positions[a].cast<double>();
    const Eigen::Vector3d q = mesh.positions[b].cast<double>() - p,
                          r = mesh.positions[c].cast<double>() - p;
    const Eigen::Vector3d twice_area = q.cross(r);
    for (const uint32_t vertex : {a, b, c}) sums[vertex] += twice_area;
  }
  std::vector<Eigen::Vector3f> normals;
  normals.reserve(sums.size());
  for (const Eigen::Vector3d& sum : sums) {
    const double length = sum.norm();
    normals.push_back(length > 0 ? Eigen::Vector3f((sum / length).cast<float>())
                                 : Eigen::Vector3f::Zero());
  }
  return normals;
}

}  // namespace veduta
