// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/dense_export.h"

#include <algorithm>
#include <filesystem>

#include "fusion/pass/scene.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/pass/view_loader.h"
#include "fusion/surface/model_writer.h"
#include "fusion/surface/simplification.h"

namespace veduta {
namespace {

constexpr double kCameraDepth = 0.03;  // of the box's diagonal: the length of a camera's pyramid
constexpr size_t kBoxVertexStep = 16;  // every so many vertices tell where a surface lies
constexpr size_t kTilesTogether = 64;  // in one picture's scene: some 100 MB

Status PrepareFolder(const std::string& out) {
  std::error_code error;
  if (std::filesystem::exists(out, error) && !std::filesystem::is_empty(out, error)) {
    return Status::AlreadyExists(out + " exists and is not empty: choose another folder");
  }
  std::filesystem::create_directories(out, error);
  return error ? Status::IoError("cannot make folder " + out + ": " + error.message())
               : Status::Ok();
}

// Those that stand, largest first.
Result<std::vector<ReconstructionRecord>> Standing(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ReconstructionRecord> records,
                          snapshot.ListReconstructions());
  std::erase_if(records, [](const ReconstructionRecord& r) { return r.merged_into.valid(); });
  std::ranges::stable_sort(
      records, [](const auto& a, const auto& b) { return a.image_count > b.image_count; });
  return records;
}

Result<std::vector<CloudPoint>> LoadPoints(const Snapshot& snapshot,
                                           const ReconstructionRecord& reconstruction) {
  std::vector<CloudPoint> points;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPointBlocks(
      reconstruction.id, reconstruction.points_generation, [&](const PointBlock& block) {
        for (const PointRecord& p : block.points) {
          points.push_back({p.position.cast<float>(), Eigen::Vector3f::Zero(), p.rgb});
        }
        return true;
      }));
  return points;
}

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

Status AddTiles(const Snapshot& snapshot, const TileRecords& tiles, double error_max,
                ModelWriter* writer) {
  for (const auto& [place, tile] : tiles) {
    if (tile.triangle_count > 0) VEDUTA_RETURN_IF_ERROR(AddTile(snapshot, tile, error_max, writer));
  }
  return Status::Ok();
}

// Everything of one reconstruction but its tiles' triangles.
struct Model {
  std::vector<CloudPoint> points;
  std::vector<ExportedCamera> cameras;
  TileRecords tiles;
  bool has_surface = false;
};

Status WritePly(const Snapshot& snapshot, const Model& model, const DenseExportOptions& options,
                double camera_depth, ExportedSurface* exported) {
  VEDUTA_ASSIGN_OR_RETURN(const auto points,
                          OpenPly(exported->folder + "/points.ply", {.normals = false}));
  VEDUTA_RETURN_IF_ERROR(points->AddPoints(model.points));
  VEDUTA_RETURN_IF_ERROR(points->Finish().status());
  VEDUTA_RETURN_IF_ERROR(WriteCameras(exported->folder + "/cameras", model.cameras, camera_depth));
  if (!model.has_surface) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const auto mesh, OpenPly(exported->folder + "/mesh.ply", {}));
  VEDUTA_RETURN_IF_ERROR(AddTiles(snapshot, model.tiles, options.error_max, mesh.get()));
  VEDUTA_ASSIGN_OR_RETURN(const ModelCounts counts, mesh->Finish());
  exported->vertices = counts.vertices;
  exported->triangles = counts.triangles;
  return Status::Ok();
}

Status WriteGltf(const Snapshot& snapshot, const Model& model, const DenseExportOptions& options,
                 ExportedSurface* exported) {
  std::vector<ViewGeometry> views;
  for (const ExportedCamera& camera : model.cameras) views.push_back(camera.geometry);
  VEDUTA_ASSIGN_OR_RETURN(const auto writer,
                          OpenGlb(exported->folder + "/model.glb", {}, MeanUp(views)));
  VEDUTA_RETURN_IF_ERROR(AddTiles(snapshot, model.tiles, options.error_max, writer.get()));
  VEDUTA_RETURN_IF_ERROR(writer->AddPoints(model.points));
  VEDUTA_RETURN_IF_ERROR(writer->AddCameras(model.cameras));
  VEDUTA_ASSIGN_OR_RETURN(const ModelCounts counts, writer->Finish());
  exported->vertices = counts.vertices;
  exported->triangles = counts.triangles;
  return Status::Ok();
}

Result<ExportedSurface> ExportOne(const Snapshot& snapshot, const ReconstructionRecord& record,
                                  const std::string& folder, const DenseExportOptions& options) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Status::IoError("cannot make folder " + folder + ": " + error.message());
  VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadScene(snapshot, record.id));
  Model model;
  VEDUTA_ASSIGN_OR_RETURN(model.points, LoadPoints(snapshot, record));
  for (const auto& [id, image] : scene.images) {
    model.cameras.push_back({image.record.name, ViewGeometryOf(image, 0)});
  }
  VEDUTA_ASSIGN_OR_RETURN(model.tiles, LoadTileRecords(snapshot, record.id));
  model.has_surface = std::ranges::any_of(
      model.tiles, [](const auto& tile) { return tile.second.triangle_count > 0; });
  ExportedSurface exported{record.id, folder, model.cameras.size(), model.points.size(), 0, 0};
  if (options.format == ModelFormat::kGltf) {
    VEDUTA_RETURN_IF_ERROR(WriteGltf(snapshot, model, options, &exported));
    return exported;
  }
  VEDUTA_ASSIGN_OR_RETURN(const Eigen::AlignedBox3d box, BoxOf(snapshot, record.id));
  VEDUTA_RETURN_IF_ERROR(
      WritePly(snapshot, model, options, kCameraDepth * box.diagonal().norm(), &exported));
  return exported;
}

Status DrawTiles(const Snapshot& snapshot, const TileRecords& tiles, const ViewGeometry& view,
                 const RenderOptions& options, ThreadPool& pool, Picture* picture) {
  VEDUTA_ASSIGN_OR_RETURN(const auto device, RayDevice::Open());
  std::vector<std::shared_ptr<const RayTile>> together;
  const auto draw = [&]() -> Status {
    VEDUTA_ASSIGN_OR_RETURN(const auto scene, RayScene::Make(device, std::move(together)));
    together.clear();
    return DrawSurface(*scene, view, options, pool, picture);
  };
  for (const auto& [place, tile] : tiles) {
    if (tile.triangle_count == 0) continue;
    VEDUTA_ASSIGN_OR_RETURN(TileSurface surface, LoadSurface(snapshot, tile));
    VEDUTA_ASSIGN_OR_RETURN(auto ray_tile, RayTile::Make(device, MeshOf(std::move(surface))));
    together.push_back(std::move(ray_tile));
    if (together.size() == kTilesTogether) VEDUTA_RETURN_IF_ERROR(draw());
  }
  return together.empty() ? Status::Ok() : draw();
}

Result<SceneImage> LoadSceneImage(const Snapshot& snapshot, ImageId id) {
  SceneImage image;
  VEDUTA_ASSIGN_OR_RETURN(image.record, snapshot.GetImage(id));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(id));
  if (!pose)
    return Status::NotFound("image " + image.record.name + " has no pose: " + image.record.detail);
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(image.record.camera));
  image.camera = camera.model;
  image.cam_from_world = pose->cam_from_world;
  return image;
}

}  // namespace

Result<std::vector<ExportedSurface>> ExportSurfaces(const Snapshot& snapshot,
                                                    const std::string& out,
                                                    const DenseExportOptions& options,
                                                    ThreadPool& pool) {
  if (!(options.error_max >= 0))
    return Status::InvalidArgument("the error of a simplified surface must be 0 or more");
  VEDUTA_RETURN_IF_ERROR(PrepareFolder(out));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> records, Standing(snapshot));
  std::vector<ExportedSurface> exported;
  for (const ReconstructionRecord& record : records) {
    const std::string folder =
        (std::filesystem::path(out) / std::to_string(exported.size())).string();
    VEDUTA_ASSIGN_OR_RETURN(exported.emplace_back(), ExportOne(snapshot, record, folder, options));
  }
  return exported;
}

Result<ViewGeometry> PhotoGeometry(const Snapshot& snapshot, ImageId image, uint32_t side_px) {
  VEDUTA_ASSIGN_OR_RETURN(const SceneImage found, LoadSceneImage(snapshot, image));
  return ViewGeometryOf(found, side_px);
}

Result<Eigen::AlignedBox3d> BoxOf(const Snapshot& snapshot, ReconstructionId reconstruction) {
  std::array<std::vector<float>, 3> coordinates;
  const auto add = [&](const Eigen::Vector3f& x) {
    for (int axis = 0; axis < 3; ++axis) coordinates[axis].push_back(x[axis]);
  };
  VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadTileRecords(snapshot, reconstruction));
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

Result<Picture> DrawReconstruction(const Snapshot& snapshot, ReconstructionId reconstruction,
                                   Drawn drawn, const ViewGeometry& view,
                                   const RenderOptions& options, ThreadPool& pool) {
  VEDUTA_ASSIGN_OR_RETURN(Picture picture, BlankPicture(view, options));
  VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadTileRecords(snapshot, reconstruction));
  const bool has_surface =
      std::ranges::any_of(tiles, [](const auto& tile) { return tile.second.triangle_count > 0; });
  if (drawn == Drawn::kSurface && !has_surface) {
    return Status::NotFound("reconstruction " + std::to_string(reconstruction.value) +
                            " has no surface: make one with 'veduta densify'");
  }
  if (has_surface && drawn != Drawn::kPoints) {
    VEDUTA_RETURN_IF_ERROR(DrawTiles(snapshot, tiles, view, options, pool, &picture));
    return picture;
  }
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          snapshot.GetReconstruction(reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CloudPoint> points, LoadPoints(snapshot, record));
  VEDUTA_RETURN_IF_ERROR(DrawPoints(points, view, options, pool, &picture));
  return picture;
}

Result<BalancedPhoto> LoadBalancedPhoto(std::shared_ptr<const Snapshot> snapshot, ImageId image,
                                        uint32_t side_px) {
  VEDUTA_ASSIGN_OR_RETURN(const SceneImage found, LoadSceneImage(*snapshot, image));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<DepthRecord> depth,
                          snapshot->dense().FindDepth(image));
  ViewLoader loader(snapshot, side_px, 1);
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const View> view, loader.Load(found));
  const bool has_gain = depth && depth->gain[0] > 0;
  return BalancedPhoto{*view, has_gain
                                  ? Eigen::Vector3f(depth->gain[0], depth->gain[1], depth->gain[2])
                                  : Eigen::Vector3f::Ones().eval()};
}

}  // namespace veduta
