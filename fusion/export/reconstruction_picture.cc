// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/reconstruction_picture.h"

#include <optional>
#include <utility>

#include "fusion/export/surface_model.h"
#include "fusion/pass/scene.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/pass/view_loader.h"

namespace veduta {
namespace {

constexpr size_t kTilesTogether = 64;  // in one picture's scene: some 100 MB

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

Result<ViewGeometry> PhotoGeometry(const Snapshot& snapshot, ImageId image, uint32_t side_px) {
  VEDUTA_ASSIGN_OR_RETURN(const SceneImage found, LoadSceneImage(snapshot, image));
  return ViewGeometryOf(found, side_px);
}

Result<Picture> DrawReconstruction(const Snapshot& snapshot, ReconstructionId reconstruction,
                                   Drawn drawn, const ViewGeometry& view,
                                   const RenderOptions& options, ThreadPool& pool) {
  VEDUTA_ASSIGN_OR_RETURN(Picture picture, BlankPicture(view, options));
  VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadCurrentTiles(snapshot, reconstruction));
  const bool has_surface = HasSurface(tiles);
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
