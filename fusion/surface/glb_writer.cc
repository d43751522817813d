// SPDX-License-Identifier: Apache-2.0
// Binary glTF 2.0 (Khronos, "glTF 2.0 Specification", chapter 4): a header, a chunk of JSON, a
// chunk of bytes.
#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "fusion/surface/glb_parts.h"
#include "fusion/surface/model_spool.h"

namespace veduta {
namespace {

using nlohmann::json;

constexpr double kNear = 0.01;

void TriangleBytes(const std::array<uint32_t, 3>& triangle, std::vector<uint8_t>* bytes) {
  for (const uint32_t v : triangle) AppendBytes(v, bytes);
}

json Quaternion(const Eigen::Quaterniond& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}

// Ours has x right, y down, z forward; glTF's x right, y up, and looks along -z.
json CameraNode(const ExportedCamera& camera, size_t index) {
  const Eigen::Quaterniond half_turn(0, 1, 0, 0);  // about x: y and z change sign
  const Eigen::Quaterniond rotation =
      (camera.geometry.cam_from_world.rotation.conjugate() * half_turn).normalized();
  const Eigen::Vector3d center = camera.geometry.cam_from_world.Center();
  return {{"name", camera.name},
          {"camera", index},
          {"rotation", Quaternion(rotation)},
          {"translation", {center.x(), center.y(), center.z()}}};
}

json PerspectiveCamera(const ExportedCamera& camera) {
  const ViewGeometry& g = camera.geometry;
  const Pinhole& c = g.camera;
  return {{"name", camera.name},
          {"type", "perspective"},
          {"perspective",
           {{"yfov", 2 * std::atan(0.5 * g.height_px / c.fy)},
            {"aspectRatio", g.width_px / c.fx / (g.height_px / c.fy)},
            {"znear", kNear}}},
          {"extras",
           {{"width", g.width_px},
            {"height", g.height_px},
            {"fx", c.fx},
            {"fy", c.fy},
            {"cx", c.cx},
            {"cy", c.cy}}}};
}

Status CheckCamera(const ExportedCamera& camera) {
  const ViewGeometry& g = camera.geometry;
  const Pinhole& c = g.camera;
  const bool is_right = g.width_px > 0 && g.height_px > 0 && c.fx > 0 && c.fy > 0 &&
                        std::isfinite(c.fx + c.fy + c.cx + c.cy) &&
                        g.cam_from_world.translation.allFinite() &&
                        g.cam_from_world.rotation.coeffs().allFinite();
  if (is_right) return {};
  return Status::InvalidArgument("camera " + camera.name +
                                 ": size, intrinsics or pose are not finite and positive");
}

class GlbWriter final : public ModelWriter {
 public:
  GlbWriter(const std::string& path, const ModelContents& contents, const Eigen::Vector3d& up)
      : layout_{contents.normals, contents.colors},
        root_from_world_(Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitY())),
        spool_(path, GlbVertexBytes(layout_), TriangleBytes, GlbVertexBytes(kPointLayout)) {}

  Status AddMesh(const TriangleMesh& mesh, std::span<const uint64_t> keys) override {
    return spool_.AddMesh(mesh, keys);
  }
  Status AddPoints(std::span<const CloudPoint> points) override { return spool_.AddPoints(points); }

  Status AddCameras(std::span<const ExportedCamera> cameras) override {
    for (const ExportedCamera& camera : cameras) VEDUTA_RETURN_IF_ERROR(CheckCamera(camera));
    cameras_.insert(cameras_.end(), cameras.begin(), cameras.end());
    return {};
  }

  Result<ModelCounts> Finish() override {
    const uint64_t binary = spool_.size_bytes();  // a multiple of 4: all records are
    const std::string head = GlbHead(Document(), binary);
    if (head.size() + binary > std::numeric_limits<uint32_t>::max()) {
      return Status::InvalidArgument(
          spool_.path() + ": " + std::to_string((head.size() + binary) >> 20) +
          " MB are more than a binary glTF can hold (4096); write a PLY, or simplify");
    }
    VEDUTA_RETURN_IF_ERROR(WriteAndRename(spool_.path(), [&](std::ofstream& out) {
      out << head;
      return spool_.CopyTo(out);
    }));
    spool_.RemoveFiles();
    ModelCounts counts = spool_.counts();
    counts.cameras = cameras_.size();
    return counts;
  }

 private:
  static constexpr GlbLayout kPointLayout = {false, true};

  json Document() const {
    const ModelCounts& counts = spool_.counts();
    json document = GlbDocument();
    document["scenes"] = {{{"nodes", {0}}}};
    json nodes = {{{"name", "world"}, {"rotation", Quaternion(root_from_world_)}}},
         meshes = json::array();
    GlbBuffer buffer;
    const auto add_mesh = [&](const char* name, json primitive) {
      primitive["material"] = 0;
      nodes.push_back({{"name", name}, {"mesh", meshes.size()}});
      meshes.push_back({{"name", name}, {"primitives", {std::move(primitive)}}});
    };
    if (counts.vertices > 0) {
      json primitive = {
          {"attributes", buffer.AddVertices(counts.vertices, layout_, spool_.mesh_bounds())}};
      if (counts.triangles > 0) primitive["indices"] = buffer.AddIndices(counts.triangles * 3);
      primitive["mode"] = counts.triangles > 0
                              ? kGlbTriangles
                              : kGlbPoints;  // none: welding left no triangle with an area
      add_mesh("surface", std::move(primitive));
    }
    if (counts.points > 0) {
      json attributes = buffer.AddVertices(counts.points, kPointLayout, spool_.point_bounds());
      add_mesh("points", {{"attributes", std::move(attributes)}, {"mode", kGlbPoints}});
    }
    buffer.MoveTo(&document);
    for (size_t i = 0; i < cameras_.size(); ++i) {
      nodes.push_back(CameraNode(cameras_[i], i));
      document["cameras"].push_back(PerspectiveCamera(cameras_[i]));
    }
    for (size_t i = 1; i < nodes.size(); ++i) nodes[0]["children"].push_back(i);
    document["nodes"] = std::move(nodes);
    if (!meshes.empty()) {
      document["meshes"] = std::move(meshes);
      AddGlbMaterial(&document);
    }
    return document;
  }

  const GlbLayout layout_;
  const Eigen::Quaterniond root_from_world_;
  ModelSpool spool_;
  std::vector<ExportedCamera> cameras_;
};

}  // namespace

Result<std::unique_ptr<ModelWriter>> OpenGlb(const std::string& path, const ModelContents& contents,
                                             const Eigen::Vector3d& up_in_world) {
  if (!up_in_world.allFinite() || !(up_in_world.norm() > 1e-9)) {
    return Status::InvalidArgument(path + ": the world's up has no direction");
  }
  return std::unique_ptr<ModelWriter>(std::make_unique<GlbWriter>(path, contents, up_in_world));
}

Eigen::Vector3d MeanUp(std::span<const Rigid3> upright_cams) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Rigid3& cam_from_world : upright_cams)
    sum += cam_from_world.rotation.conjugate() * -Eigen::Vector3d::UnitY();
  const double norm_min = 1e-3 * static_cast<double>(upright_cams.size());
  if (!sum.allFinite() || sum.norm() < norm_min || upright_cams.empty())
    return Eigen::Vector3d::UnitZ();
  return sum.normalized();
}

Result<uint64_t> WeldKey(int32_t x, int32_t y, int32_t z, int32_t axis) {
  constexpr int32_t kHalf = 1 << 19;
  uint64_t key = 0;
  for (const int32_t coordinate : {x, y, z}) {
    if (coordinate < -kHalf || coordinate >= kHalf) {
      return Status::InvalidArgument("voxel coordinate " + std::to_string(coordinate) +
                                     " is outside [-2^19, 2^19)");
    }
    key = key << 20 | static_cast<uint64_t>(coordinate + kHalf);
  }
  if (axis < 0 || axis > 2)
    return Status::InvalidArgument("axis " + std::to_string(axis) + " is none of 0, 1, 2");
  return key << 2 | static_cast<uint64_t>(axis);
}

}  // namespace veduta
