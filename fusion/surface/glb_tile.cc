// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/glb_tile.h"

#include <limits>
#include <string>

#include "fusion/surface/glb_parts.h"
#include "fusion/surface/mesh_check.h"

namespace veduta {
namespace {

using nlohmann::json;

constexpr GlbLayout kLayout = {.normals = false, .colors = true};
constexpr std::array<uint8_t, 3> kNoColor = {128, 128, 128};

// Of a frame with z up in one with y up.
template <typename Vector>
Vector YUp(const Vector& z_up) {
  return {z_up.x(), z_up.z(), -z_up.y()};
}

// 0xFFFF is no index (glTF 2.0, section 3.7.2.1).
uint64_t IndexBytes(const TriangleMesh& mesh) {
  return mesh.positions.size() < std::numeric_limits<uint16_t>::max() ? 2 : 4;
}

// Vertices, then triangles.
std::vector<uint8_t> BufferBytes(const TriangleMesh& mesh, const Eigen::Vector3d& center,
                                 ModelSpool::Bounds* bounds) {
  std::vector<uint8_t> bytes;
  const uint64_t index_bytes = IndexBytes(mesh);
  bytes.reserve(mesh.positions.size() * kLayout.stride() + mesh.triangles.size() * 3 * index_bytes +
                4);
  const AppendVertex append = GlbVertexBytes(kLayout);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const Eigen::Vector3d relative = mesh.positions[i].cast<double>() - center;
    const Eigen::Vector3f position = YUp(relative).cast<float>();
    append({position, Eigen::Vector3f::UnitZ(), mesh.colors.empty() ? kNoColor : mesh.colors[i]},
           &bytes);
    bounds->low = i == 0 ? position : bounds->low.cwiseMin(position).eval();
    bounds->high = i == 0 ? position : bounds->high.cwiseMax(position).eval();
  }
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t v : triangle) {
      if (index_bytes == 2) {
        AppendBytes(static_cast<uint16_t>(v), &bytes);
      } else {
        AppendBytes(v, &bytes);
      }
    }
  }
  bytes.resize((bytes.size() + 3) / 4 * 4);
  return bytes;
}

}  // namespace

Result<std::vector<uint8_t>> MakeGlbTile(const TriangleMesh& mesh, const Eigen::Vector3d& center) {
  VEDUTA_RETURN_IF_ERROR(CheckMesh(mesh));
  if (!center.allFinite()) return Status::InvalidArgument("a tile's centre is not finite");
  json document = GlbDocument();
  std::vector<uint8_t> binary;
  if (mesh.triangles.empty()) {
    document["scenes"] = {{{"name", "empty"}}};
  } else {
    ModelSpool::Bounds bounds;
    binary = BufferBytes(mesh, center, &bounds);
    GlbBuffer buffer;
    json primitive = {{"attributes", buffer.AddVertices(mesh.positions.size(), kLayout, bounds)}};
    primitive["indices"] = buffer.AddIndices(mesh.triangles.size() * 3, IndexBytes(mesh));
    primitive["material"] = 0;
    buffer.MoveTo(&document);
    const Eigen::Vector3d place = YUp(center);
    document["scenes"] = {{{"nodes", {0}}}};
    document["nodes"] = {{{"mesh", 0}, {"translation", {place.x(), place.y(), place.z()}}}};
    document["meshes"] = {{{"primitives", {std::move(primitive)}}}};
    AddGlbMaterial(&document);
  }
  const std::string head = GlbHead(document, binary.size());
  if (head.size() + binary.size() > std::numeric_limits<uint32_t>::max())
    return Status::InvalidArgument("a tile of more than 4 GB is no binary glTF");
  std::vector<uint8_t> bytes(head.begin(), head.end());
  bytes.insert(bytes.end(), binary.begin(), binary.end());
  return bytes;
}

}  // namespace veduta
