// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/model_spool.h"

#include <bit>
#include <utility>

#include "fusion/surface/mesh_check.h"

namespace veduta {
namespace {

static_assert(std::endian::native == std::endian::little,
              "PLY and glTF are written as memory lies");

constexpr uint64_t kVerticesMax = 0x7fffffff;  // PLY's indices are signed

Eigen::Vector3f UnitOrUp(const Eigen::Vector3f& normal) {
  const double length = normal.cast<double>().norm();
  if (!(length > 1e-12)) return Eigen::Vector3f::UnitZ();
  return (normal.cast<double>() / length).cast<float>();
}

void Extend(const Eigen::Vector3f& x, bool is_first, ModelSpool::Bounds* bounds) {
  bounds->low = is_first ? x : Eigen::Vector3f(bounds->low.cwiseMin(x));
  bounds->high = is_first ? x : Eigen::Vector3f(bounds->high.cwiseMax(x));
}

}  // namespace

ModelSpool::ModelSpool(std::string path, AppendVertex append_vertex, AppendTriangle append_triangle,
                       AppendVertex append_point)
    : path_(std::move(path)),
      append_vertex_(std::move(append_vertex)),
      append_triangle_(std::move(append_triangle)),
      append_point_(std::move(append_point)) {}

Status ModelSpool::Flush(std::optional<SpoolFile>* file, const char* suffix,
                         const std::vector<uint8_t>& bytes) {
  if (bytes.empty()) return {};
  if (!*file) file->emplace(path_ + suffix);
  return (*file)->Append(bytes.data(), bytes.size());
}

Status ModelSpool::AddMesh(const TriangleMesh& mesh, std::span<const uint64_t> keys) {
  VEDUTA_RETURN_IF_ERROR(CheckMesh(mesh));
  if (!keys.empty() && keys.size() != mesh.positions.size()) {
    return Status::InvalidArgument("mesh: " + std::to_string(keys.size()) + " keys for " +
                                   std::to_string(mesh.positions.size()) + " positions");
  }
  if (counts_.vertices + mesh.positions.size() > kVerticesMax) {
    return Status::InvalidArgument(path_ + ": more than 2^31 vertices; export a part, or simplify");
  }
  const VertexWeld::Piece piece = weld_.Add(mesh, keys);
  std::vector<uint8_t> bytes;
  for (const uint32_t v : piece.new_vertices) {
    SpooledVertex vertex = {mesh.positions[v], Eigen::Vector3f::UnitZ(), {128, 128, 128}};
    if (!mesh.normals.empty()) vertex.normal = UnitOrUp(mesh.normals[v]);
    if (!mesh.colors.empty()) vertex.rgb = mesh.colors[v];
    Extend(vertex.position, counts_.vertices++ == 0, &mesh_bounds_);
    append_vertex_(vertex, &bytes);
  }
  VEDUTA_RETURN_IF_ERROR(Flush(&vertices_, ".vertices", bytes));
  bytes.clear();
  for (const auto& triangle : piece.triangles) append_triangle_(triangle, &bytes);
  counts_.triangles += piece.triangles.size();
  return Flush(&triangles_, ".triangles", bytes);
}

Status ModelSpool::AddPoints(std::span<const CloudPoint> points) {
  if (counts_.points + points.size() > kVerticesMax) {
    return Status::InvalidArgument(path_ + ": more than 2^31 points; export a part");
  }
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i < points.size(); ++i) {
    const CloudPoint& point = points[i];
    if (!point.position.allFinite() || !point.normal.allFinite()) {
      return Status::InvalidArgument("point " + std::to_string(i) + " is not finite");
    }
    Extend(point.position, counts_.points++ == 0, &point_bounds_);
    append_point_({point.position, point.normal, point.rgb}, &bytes);
  }
  return Flush(&points_, ".points", bytes);
}

uint64_t ModelSpool::size_bytes() const {
  uint64_t size = 0;
  for (const auto* file : {&vertices_, &triangles_, &points_})
    size += *file ? (*file)->size_bytes() : 0;
  return size;
}

Status ModelSpool::CopyTo(std::ofstream& out) {
  for (auto* file : {&vertices_, &triangles_, &points_}) {
    if (*file) VEDUTA_RETURN_IF_ERROR((*file)->CopyTo(out));
  }
  return {};
}

void ModelSpool::RemoveFiles() {
  for (auto* file : {&vertices_, &triangles_, &points_}) file->reset();
}

}  // namespace veduta
