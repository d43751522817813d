// SPDX-License-Identifier: Apache-2.0
// One gain for every photo that has none, and the colours of every tile whose surface, photos or
// occluders changed.
#include <algorithm>
#include <string>
#include <utility>

#include "fusion/pass/range_images.h"
#include "fusion/pass/stage.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/pass/view_loader.h"
#include "fusion/surface/color_view.h"
#include "fusion/surface/exposure.h"
#include "fusion/surface/ray_tile_cache.h"
#include "fusion/surface/tiles_between.h"
#include "fusion/surface/vertex_color.h"
#include "storage/base/lru_cache.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// Where a photo stands for the surface, and how it looks: the pose that its depth map was
// integrated with.
struct ColorSource {
  ViewGeometry geometry;
  std::array<float, 3> gain{};
};

// Images of this reconstruction that have a depth map.
Result<std::map<ImageId, DepthRecord>> LoadDepths(const DensePass& pass) {
  std::map<ImageId, DepthRecord> depths;
  VEDUTA_RETURN_IF_ERROR(pass.GetSnapshot()->dense().ScanDepths([&](const DepthRecord& depth) {
    const bool is_in_scene = pass.scene().images.contains(depth.image);
    if (depth.reconstruction == pass.reconstruction() && is_in_scene) depths[depth.image] = depth;
    return true;
  }));
  return depths;
}

// What photos say about the points that those without a gain (not in `fixed`) see.
Result<std::vector<ColorObservation>> Observe(const DensePass& pass,
                                              const std::map<ImageId, DepthRecord>& depths,
                                              const std::map<ImageId, Eigen::Vector3f>& fixed) {
  const Scene& scene = pass.scene();
  std::vector<uint8_t> wanted(scene.points.size());
  for (const auto& [id, depth] : depths) {
    if (fixed.contains(id)) continue;
    for (const SceneObservation& o : scene.images.at(id).observations) wanted[o.point] = 1;
  }
  const auto snapshot = pass.GetSnapshot();
  std::vector<ColorObservation> observations;
  for (const auto& [id, depth] : depths) {
    const SceneImage& image = scene.images.at(id);
    const auto is_wanted = [&](const SceneObservation& o) { return wanted[o.point] != 0; };
    if (std::ranges::none_of(image.observations, is_wanted)) continue;
    const Result<Features> stored = snapshot->GetFeatures(image.record.photo);
    if (stored.status().code() == StatusCode::kCorruption) continue;  // the others will do
    VEDUTA_RETURN_IF_ERROR(stored.status());
    const Features& features = *stored;
    for (const SceneObservation& o : image.observations) {
      if (!is_wanted(o) || o.feature >= features.size()) continue;
      observations.push_back({id, scene.points[o.point].id, features.keypoints[o.feature].rgb});
    }
  }
  return observations;
}

class ColorStage final {
 public:
  ColorStage(const ColorStageOptions& options, DensePass* pass)
      : options_(options),
        coloring_(options.coloring),
        pass_(*pass),
        snapshot_(pass->GetSnapshot()),
        loader_(snapshot_, options.side_px, /*view_bytes_max=*/1, pass->views()),
        views_(pass->map_bytes_max()) {}

  Result<StageCount> Run() {
    VEDUTA_ASSIGN_OR_RETURN(const auto depths, LoadDepths(pass_));
    for (const auto& [id, depth] : depths) {
      VEDUTA_ASSIGN_OR_RETURN(const CheckedDepthRecord checked,
                              snapshot_->dense().GetCheckedDepth(id, depth.checked_version));
      sources_[id] = {GeometryOf(checked), depth.gain};
    }
    VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles, LoadTileRecords(*snapshot_, pass_.surface()));
    const double side = kTileSide * coloring_.voxel_size;
    for (const auto& [place, tile] : tiles) {
      if (tile.triangle_count == 0) continue;
      tiles_.push_back(tile);
      const Eigen::Vector3d low = Eigen::Vector3d(place.x, place.y, place.z) * side;
      // Cells reach over to the first voxels of the next tile.
      boxes_.emplace_back(low, low + Eigen::Vector3d::Constant(side + coloring_.voxel_size));
    }
    VEDUTA_ASSIGN_OR_RETURN(ray_device_, RayDevice::Open());
    RayTileCache rays(
        ray_device_, [&](uint64_t tile) { return LoadMesh(tile); }, pass_.mesh_bytes_max());
    for (size_t i = 0; i < tiles_.size(); ++i) {
      VEDUTA_RETURN_IF_ERROR(pass_.Tell("colours", i, tiles_.size()));
      VEDUTA_RETURN_IF_ERROR(Update(i, &rays));
    }
    VEDUTA_RETURN_IF_ERROR(pass_.Tell("colours", tiles_.size(), tiles_.size()));
    return count_;
  }

 private:
  Result<TriangleMesh> LoadMesh(uint64_t tile) const {
    VEDUTA_ASSIGN_OR_RETURN(TileSurface surface, LoadSurface(*snapshot_, tiles_[tile]));
    surface.colors.clear();
    return MeshOf(std::move(surface));
  }

  // Photos in whose frustum the tile lies, near enough; ascending.
  std::vector<ImageId> ViewsOf(size_t tile) const {
    std::vector<ImageId> views;
    for (const auto& [id, source] : sources_) {
      const double far =
          coloring_.voxels_per_pixel_max * coloring_.voxel_size * source.geometry.camera.fx;
      if (MaySeeTile(source.geometry, far, tiles_[tile].place, options_.grid)) views.push_back(id);
    }
    return views;
  }

  uint64_t VersionOfColors(size_t tile, std::span<const ImageId> views,
                           std::span<const uint32_t> between) const {
    VersionFeed feed(options_);
    feed << tiles_[tile].mesh_version;
    for (const ImageId id : views) {
      feed << id << sources_.at(id).geometry.cam_from_world;
      for (const float gain : sources_.at(id).gain) feed << gain;
    }
    for (const uint32_t i : between)
      feed << tiles_[i].place.x << tiles_[i].place.y << tiles_[i].place.z << tiles_[i].mesh_version;
    return feed.Version();
  }

  Result<std::shared_ptr<const ColorView>> GetView(ImageId id) {
    const auto make = [&]() -> Result<std::shared_ptr<const ColorView>> {
      const auto loaded = loader_.Load(pass_.scene().images.at(id));
      if (loaded.status().code() == StatusCode::kCorruption) damaged_ = id;
      VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const View> view, loaded);
      const std::array<float, 3>& gain = sources_.at(id).gain;
      View placed = *view;
      placed.geometry.cam_from_world = sources_.at(id).geometry.cam_from_world;
      VEDUTA_ASSIGN_OR_RETURN(ColorView made,
                              ColorView::Make(placed, Eigen::Vector3f(gain[0], gain[1], gain[2])));
      return std::make_shared<const ColorView>(std::move(made));
    };
    return views_.GetOrMake(id.value, make, [](const auto& view) {
      return 8 * uint64_t{view->geometry().width_px} * view->geometry().height_px;
    });
  }

  // The tiles that may stand between a tile and the photos that may see it.
  std::vector<uint32_t> TilesAround(size_t tile, std::span<const ImageId> views) const {
    if (views.empty()) return {static_cast<uint32_t>(tile)};
    std::vector<Eigen::Vector3d> centers;
    for (const ImageId id : views)
      centers.push_back(sources_.at(id).geometry.cam_from_world.Center());
    Eigen::AlignedBox3d around = boxes_[tile];
    around.min().array() -= ColoringReach(coloring_);
    around.max().array() += ColoringReach(coloring_);
    return TilesBetween(boxes_, around, centers);
  }

  Result<VertexColors> Color(size_t tile, std::span<const ImageId> views,
                             std::span<const uint32_t> between, RayTileCache* rays) {
    std::vector<std::shared_ptr<const ColorView>> held;
    std::vector<const ColorView*> used;
    for (const ImageId id : views) {
      VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const ColorView> view, GetView(id));
      used.push_back(view.get());
      held.push_back(std::move(view));
    }
    std::vector<std::shared_ptr<const RayTile>> scene_tiles;
    for (const uint32_t i : between) {
      VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const RayTile> ray_tile, rays->Get(i));
      scene_tiles.push_back(std::move(ray_tile));
    }
    VEDUTA_ASSIGN_OR_RETURN(const auto scene, RayScene::Make(ray_device_, std::move(scene_tiles)));
    VEDUTA_ASSIGN_OR_RETURN(const auto own, rays->Get(tile));
    return ColorVertices(own->mesh(), *scene, used, coloring_, pass_.pool());
  }

  Status Update(size_t tile, RayTileCache* rays) {
    const std::vector<ImageId> views = ViewsOf(tile);
    const std::vector<uint32_t> between = TilesAround(tile, views);
    const uint64_t version = VersionOfColors(tile, views, between);
    if (tiles_[tile].color_version == version) {
      ++count_.kept;
      return Status::Ok();
    }
    const Result<VertexColors> colored = Color(tile, views, between, rays);
    if (damaged_.valid()) {
      // The other photos give the colours.
      sources_.erase(std::exchange(damaged_, ImageId()));
      return Update(tile, rays);
    }
    VEDUTA_ASSIGN_OR_RETURN(const VertexColors colors, colored);
    TileRecord record = tiles_[tile];
    record.color_version = version;
    const std::vector<uint8_t> bytes =
        SerializeColors(record.mesh_version, colors.colors, colors.view_counts);
    ++count_.computed;
    const auto write = [&](const Snapshot&, Transaction* transaction) {
      transaction->dense().PutSurface(SurfacePart::kColors, record.reconstruction, record.place,
                                      bytes);
      transaction->dense().PutTile(record);
      return Status::Ok();
    };
    return pass_.CommitTile(tiles_[tile], record.place, write);
  }

  const ColorStageOptions& options_;
  const ColoringOptions& coloring_;
  DensePass& pass_;
  const std::shared_ptr<const Snapshot> snapshot_;  // meshes do not change in this stage
  ViewLoader loader_;
  std::map<ImageId, ColorSource> sources_;
  ImageId damaged_;                // valid: its photo could not be read just now
  std::vector<TileRecord> tiles_;  // those with triangles; ascending places
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::shared_ptr<const RayDevice> ray_device_;
  LruCache<uint32_t, std::shared_ptr<const ColorView>> views_;  // by image
  StageCount count_;
};

}  // namespace

Result<StageCount> UpdateExposures(const ExposureStageOptions& options, DensePass* pass) {
  Stopwatch watch;
  StageCount count;
  VEDUTA_RETURN_IF_ERROR(pass->Tell("exposures", 0, 1));
  VEDUTA_ASSIGN_OR_RETURN(auto depths, LoadDepths(*pass));
  // A gain stays once it is known, so that colours do not change with every photo that is added:
  // its version names no photo.
  const uint64_t version = VersionFeed(options).Version();
  std::map<ImageId, Eigen::Vector3f> fixed;
  for (const auto& [id, depth] : depths) {
    if (depth.gain[0] > 0 && depth.exposure_version == version)
      fixed[id] = Eigen::Vector3f(depth.gain[0], depth.gain[1], depth.gain[2]);
  }
  count.kept = fixed.size();
  if (fixed.size() == depths.size()) return count;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ColorObservation> observations,
                          Observe(*pass, depths, fixed));
  VEDUTA_ASSIGN_OR_RETURN(const auto gains, SolveExposures(observations, fixed, options.exposure));
  VEDUTA_RETURN_IF_ERROR(pass->Commit([&](const Snapshot& now, Transaction* transaction) -> Status {
    for (auto& [id, depth] : depths) {
      if (fixed.contains(id)) continue;
      VEDUTA_RETURN_IF_ERROR(pass->ExpectDepth(now, depth));
      const auto found = gains.find(id);
      const Eigen::Vector3f gain = found == gains.end() ? Eigen::Vector3f::Ones() : found->second;
      depth.gain = {gain.x(), gain.y(), gain.z()};
      depth.exposure_version = version;
      transaction->dense().PutDepth(depth);
      ++count.computed;
    }
    return Status::Ok();
  }));
  count.ms = watch.LapMs();
  return count;
}

Result<StageCount> ColorTiles(const ColorStageOptions& options, DensePass* pass) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(StageCount count, ColorStage(options, pass).Run());
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
