// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/surface_model.h"

#include <algorithm>
#include <array>

#include "engine/camera/orientation.h"
#include "fusion/export/model_names.h"
#include "fusion/export/told_scene.h"
#include "fusion/pass/view_loader.h"
#include "fusion/surface/simplification.h"

namespace veduta {
namespace {

// Every so many vertices tell where a surface lies. Chosen by hand; not measured.
constexpr size_t kBoxVertexStep = 16;

Status AddTile(const Snapshot& snapshot, const TileRecord& tile, double error_max,
               ModelWriter* writer) {
  VEDUTA_ASSIGN_OR_RETURN(TileSurface surface, LoadSurface(snapshot, tile));
  std::vector<uint64_t> keys;
  for (const VertexKey& key : surface.piece.keys) {
    VEDUTA_ASSIGN_OR_RETURN(keys.emplace_back(), WeldKey(key.x, key.y, key.z, key.axis));
  }
  TriangleMesh mesh = MeshOf(std::move(surface));
  if (error_max > 0 && !mesh.triangles.empty()) {
    SimplificationOptions options;
    options.distance_max = error_max;
    VEDUTA_ASSIGN_OR_RETURN(SimplifiedMesh simple, Simplify(mesh, options));
    std::vector<uint64_t> kept;
    for (const uint32_t source : simple.source_vertex) kept.push_back(keys[source]);
    keys = std::move(kept);
    mesh = std::move(simple.mesh);
  }
  return writer->AddMesh(mesh, keys);
}

}  // namespace

ExportedModel SurfaceModel::Counts(const std::string& folder, const ModelCounts& written) const {
  return {record.id, folder, cameras.size(), points.size(), written.vertices, written.triangles};
}

Rigid3 UprightCam(const ImageRecord& image, const Rigid3& cam_from_world) {
  const Rigid3 upright_from_cam{Eigen::Quaterniond(UprightCamFromStoredCam(image.orientation)),
                                Eigen::Vector3d::Zero()};
  return upright_from_cam * cam_from_world;
}

bool HasSurface(const TileRecords& tiles) {
  return std::ranges::any_of(tiles,
                             [](const auto& tile) { return tile.second.triangle_count > 0; });
}

Result<SurfaceModel> LoadSurfaceModel(const Snapshot& snapshot, const ReconstructionRecord& record,
                                      bool with_hidden) {
  VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadToldScene(snapshot, record.id, with_hidden));
  SurfaceModel model;
  model.record = record;
  VEDUTA_ASSIGN_OR_RETURN(model.points, LoadPoints(snapshot, record));
  const std::map<ImageId, std::string> names = ModelNames(scene);
  for (const auto& [id, image] : scene.images) {
    model.cameras.push_back({names.at(id), ViewGeometryOf(image, 0)});
    model.upright_cams.push_back(UprightCam(image.record, image.cam_from_world));
  }
  VEDUTA_ASSIGN_OR_RETURN(model.tiles, LoadCurrentTiles(snapshot, record.id));
  return model;
}

Result<std::vector<CloudPoint>> LoadPoints(const Snapshot& snapshot,
                                           const ReconstructionRecord& record) {
  std::vector<CloudPoint> points;
  VEDUTA_RETURN_IF_ERROR(
      snapshot.ScanPointBlocks(record.id, record.points_generation, [&](const PointBlock& block) {
        for (const PointRecord& p : block.points) {
          points.push_back({p.position.cast<float>(), Eigen::Vector3f::Zero(), p.rgb});
        }
        return true;
      }));
  return points;
}

Status AddTiles(const Snapshot& snapshot, const TileRecords& tiles, double error_max,
                ModelWriter* writer) {
  for (const auto& [place, tile] : tiles) {
    if (tile.triangle_count > 0) VEDUTA_RETURN_IF_ERROR(AddTile(snapshot, tile, error_max, writer));
  }
  return Status::Ok();
}

Result<Eigen::AlignedBox3d> BoxOf(const Snapshot& snapshot, ReconstructionId reconstruction) {
  std::array<std::vector<float>, 3> coordinates;
  const auto add = [&](const Eigen::Vector3f& x) {
    for (int axis = 0; axis < 3; ++axis) coordinates[axis].push_back(x[axis]);
  };
  VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadCurrentTiles(snapshot, reconstruction));
  for (const auto& [place, tile] : tiles) {
    if (tile.triangle_count == 0) continue;
    VEDUTA_ASSIGN_OR_RETURN(const TileSurface surface, LoadSurface(snapshot, tile));
    for (size_t i = 0; i < surface.piece.positions.size(); i += kBoxVertexStep)
      add(surface.piece.positions[i]);
  }
  if (coordinates[0].empty()) {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                            snapshot.GetReconstruction(reconstruction));
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<CloudPoint> points, LoadPoints(snapshot, record));
    for (const CloudPoint& point : points) add(point.position);
  }
  if (coordinates[0].empty()) {
    return Status::NotFound("reconstruction " + std::to_string(reconstruction.value) +
                            " has no points");
  }
  Eigen::AlignedBox3d box;
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::sort(coordinates[axis]);
    const size_t trimmed = coordinates[axis].size() / 100;
    box.min()[axis] = coordinates[axis][trimmed];
    box.max()[axis] = coordinates[axis][coordinates[axis].size() - 1 - trimmed];
  }
  return box;
}

}  // namespace veduta
