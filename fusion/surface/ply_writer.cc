// SPDX-License-Identifier: Apache-2.0
// Binary PLY: the header's counts are known at the end only, so vertices and faces are spooled.
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fusion/surface/model_spool.h"

namespace veduta {
namespace {

AppendVertex VertexBytes(const ModelContents& contents) {
  return [contents](const SpooledVertex& vertex, std::vector<uint8_t>* bytes) {
    for (int c = 0; c < 3; ++c) AppendBytes(vertex.position[c], bytes);
    for (int c = 0; contents.normals && c < 3; ++c) AppendBytes(vertex.normal[c], bytes);
    for (int c = 0; contents.colors && c < 3; ++c) AppendBytes(vertex.rgb[c], bytes);
  };
}

void TriangleBytes(const std::array<uint32_t, 3>& triangle, std::vector<uint8_t>* bytes) {
  bytes->push_back(3);
  for (const uint32_t v : triangle) AppendBytes(v, bytes);
}

class PlyWriter final : public ModelWriter {
 public:
  PlyWriter(const std::string& path, const ModelContents& contents)
      : contents_(contents),
        spool_(path, VertexBytes(contents), TriangleBytes, VertexBytes(contents)) {}

  Status AddMesh(const TriangleMesh& mesh, std::span<const uint64_t> keys) override {
    if (spool_.counts().points > 0) return Mixed();
    return spool_.AddMesh(mesh, keys);
  }

  Status AddPoints(std::span<const CloudPoint> points) override {
    if (spool_.counts().vertices > 0) return Mixed();
    return spool_.AddPoints(points);
  }

  Status AddCameras(std::span<const ExportedCamera> /*cameras*/) override {
    return Status::InvalidArgument(spool_.path() +
                                   ": a PLY holds no cameras; write them beside it");
  }

  Result<ModelCounts> Finish() override {
    const ModelCounts& counts = spool_.counts();
    VEDUTA_RETURN_IF_ERROR(WriteAndRename(spool_.path(), [&](std::ofstream& out) {
      out << "ply\nformat binary_little_endian 1.0\ncomment Veduta\nelement vertex "
          << counts.vertices + counts.points
          << "\nproperty float x\nproperty float y\nproperty float z\n";
      if (contents_.normals) out << "property float nx\nproperty float ny\nproperty float nz\n";
      if (contents_.colors)
        out << "property uchar red\nproperty uchar green\nproperty uchar blue\n";
      if (counts.points == 0)
        out << "element face " << counts.triangles << "\nproperty list uchar int vertex_indices\n";
      out << "end_header\n";
      return spool_.CopyTo(out);
    }));
    spool_.RemoveFiles();
    return counts;
  }

 private:
  Status Mixed() const {
    return Status::InvalidArgument(spool_.path() +
                                   ": a PLY holds a surface or points, not both; write two files");
  }

  const ModelContents contents_;
  ModelSpool spool_;
};

nlohmann::json CameraJson(const ExportedCamera& camera) {
  const ViewGeometry& g = camera.geometry;
  const Eigen::Vector3d center = g.cam_from_world.Center();
  const Eigen::Matrix3d r = g.cam_from_world.rotation.toRotationMatrix().transpose();
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({r(i, 0), r(i, 1), r(i, 2)});
  return {{"name", camera.name},   {"width", g.width_px},
          {"height", g.height_px}, {"fx", g.camera.fx},
          {"fy", g.camera.fy},     {"cx", g.camera.cx},
          {"cy", g.camera.cy},     {"center", {center.x(), center.y(), center.z()}},
          {"world_from_cam", rows}};
}

// A pyramid from the camera's centre over the photo's corners; its base carries other colours, so
// that one sees where a camera looks.
TriangleMesh Pyramid(const ViewGeometry& g, double depth) {
  const Rigid3 world_from_cam = g.cam_from_world.Inverse();
  TriangleMesh mesh;
  const auto add = [&](const Eigen::Vector3d& in_cam, std::array<uint8_t, 3> rgb) {
    mesh.positions.push_back((world_from_cam * in_cam).cast<float>());
    mesh.colors.push_back(rgb);
  };
  add(Eigen::Vector3d::Zero(), {220, 40, 40});
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
    const Eigen::Vector2d px(x * static_cast<double>(g.width_px) - 0.5,
                             y * static_cast<double>(g.height_px) - 0.5);
    const Eigen::Vector2d ray = depth * g.camera.Normalize(px);
    add({ray.x(), ray.y(), depth},
        y == 0 ? std::array<uint8_t, 3>{40, 90, 220} : std::array<uint8_t, 3>{40, 200, 90});
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}, {1, 3, 2}, {1, 4, 3}};
  return mesh;
}

}  // namespace

Result<std::unique_ptr<ModelWriter>> OpenPly(const std::string& path,
                                             const ModelContents& contents) {
  return std::unique_ptr<ModelWriter>(std::make_unique<PlyWriter>(path, contents));
}

Status WriteCameras(const std::string& prefix, std::span<const ExportedCamera> cameras,
                    double depth) {
  if (!(depth > 0) || !std::isfinite(depth)) {
    return Status::InvalidArgument("cameras: depth " + std::to_string(depth) + " is not positive");
  }
  nlohmann::json list = nlohmann::json::array();
  for (const ExportedCamera& camera : cameras) list.push_back(CameraJson(camera));
  VEDUTA_RETURN_IF_ERROR(WriteAndRename(prefix + ".json", [&](std::ofstream& out) {
    out << list.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
    return Status();
  }));
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<ModelWriter> writer,
                          OpenPly(prefix + ".ply", {false, true}));
  for (const ExportedCamera& camera : cameras) {
    VEDUTA_RETURN_IF_ERROR(writer->AddMesh(Pyramid(camera.geometry, depth), {}));
  }
  return writer->Finish().status();
}

}  // namespace veduta
