// SPDX-License-Identifier: Apache-2.0
// A gain for every photo that has none yet, and the colours of every tile whose surface, photos or
// occluders changed.
#include <algorithm>
#include <string>

#include "fusion/pass/pass.h"
#include "fusion/pass/range_images.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/pass/view_loader.h"
#include "fusion/surface/color_view.h"
#include "fusion/surface/exposure.h"
#include "fusion/surface/ray_tile_cache.h"
#include "fusion/surface/tiles_between.h"
#include "fusion/surface/vertex_color.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

constexpr size_t kColorViewsKept = 48;
constexpr size_t kRayTilesBytesMax = 512ull << 20;

// Where a photo stands for the surface, and how it looks: the pose that its depth map was
// integrated with.
struct ColorSource {
  ViewGeometry geometry;
  std::array<float, 3> gain{};
};

// Images of this reconstruction that have a depth map.
Result<std::map<ImageId, DepthRecord>> LoadDepths(const Pass& pass) {
  std::map<ImageId, DepthRecord> depths;
  VEDUTA_RETURN_IF_ERROR(
      pass.database.GetSnapshot()->dense().ScanDepths([&](const DepthRecord& depth) {
        if (depth.reconstruction == pass.scene.reconstruction.id) depths[depth.image] = depth;
        return true;
      }));
  return depths;
}

bool HasGain(const DepthRecord& depth) {
  return depth.gain[0] > 0;
}

// What photos say about the points that those without a gain see.
Result<std::vector<ColorObservation>> Observe(const Pass& pass,
                                              const std::map<ImageId, DepthRecord>& depths) {
  std::vector<uint8_t> wanted(pass.scene.points.size());
  for (const auto& [id, depth] : depths) {
    if (HasGain(depth)) continue;
    for (const SceneObservation& o : pass.scene.images.at(id).observations) wanted[o.point] = 1;
  }
  const auto snapshot = pass.database.GetSnapshot();
  std::vector<ColorObservation> observations;
  for (const auto& [id, depth] : depths) {
    const SceneImage& image = pass.scene.images.at(id);
    const auto is_wanted = [&](const SceneObservation& o) { return wanted[o.point] != 0; };
    if (std::ranges::none_of(image.observations, is_wanted)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const Features features, snapshot->GetFeatures(image.record.photo));
    for (const SceneObservation& o : image.observations) {
      if (!is_wanted(o) || o.feature >= features.size()) continue;
      observations.push_back(
          {id, pass.scene.points[o.point].id, features.keypoints[o.feature].rgb});
    }
  }
  return observations;
}

class ColorStage final {
 public:
  explicit ColorStage(const Pass& pass)
      : pass_(pass),
        snapshot_(pass.database.GetSnapshot()),
        loader_(snapshot_, pass.settings.depth_side_px, /*view_count_max=*/1) {
    coloring_.voxel_size = pass.settings.voxel_size;
  }

  Result<StageCount> Run() {
    VEDUTA_ASSIGN_OR_RETURN(const auto depths, LoadDepths(pass_));
    for (const auto& [id, depth] : depths) {
      VEDUTA_ASSIGN_OR_RETURN(const CheckedDepthRecord checked,
                              snapshot_->dense().GetCheckedDepth(id, depth.checked_version));
      sources_[id] = {GeometryOf(checked), depth.gain};
    }
    VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles,
                            LoadTileRecords(*snapshot_, pass_.scene.reconstruction.id));
    const double side = kTileSide * pass_.settings.voxel_size;
    for (const auto& [place, tile] : tiles) {
      if (tile.triangle_count == 0) continue;
      tiles_.push_back(tile);
      const Eigen::Vector3d low = Eigen::Vector3d(place.x, place.y, place.z) * side;
      // Cells reach over to the first voxels of the next tile.
      boxes_.emplace_back(low, low + Eigen::Vector3d::Constant(side + pass_.settings.voxel_size));
    }
    VEDUTA_ASSIGN_OR_RETURN(ray_device_, RayDevice::Open());
    RayTileCache rays(
        ray_device_, [&](uint64_t tile) { return LoadMesh(tile); }, kRayTilesBytesMax);
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
      if (MaySeeTile(source.geometry, far, tiles_[tile].place, pass_.grid())) views.push_back(id);
    }
    return views;
  }

  uint64_t VersionOfColors(size_t tile, std::span<const ImageId> views,
                           std::span<const uint32_t> between) const {
    VersionFeed feed("colors");
    feed << tiles_[tile].mesh_version << pass_.settings.depth_side_px;
    for (const ImageId id : views) {
      feed << id << sources_.at(id).geometry.cam_from_world;
      for (const float gain : sources_.at(id).gain) feed << gain;
    }
    for (const uint32_t i : between)
      feed << tiles_[i].place.x << tiles_[i].place.y << tiles_[i].place.z << tiles_[i].mesh_version;
    return feed.Version();
  }

  Result<std::shared_ptr<const ColorView>> GetView(ImageId id) {
    for (auto it = views_.begin(); it != views_.end(); ++it) {
      if ((*it)->image() != id) continue;
      views_.splice(views_.begin(), views_, it);
      return views_.front();
    }
    VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const View> view,
                            loader_.Load(pass_.scene.images.at(id)));
    const std::array<float, 3>& gain = sources_.at(id).gain;
    View placed = *view;
    placed.geometry.cam_from_world = sources_.at(id).geometry.cam_from_world;
    VEDUTA_ASSIGN_OR_RETURN(ColorView made,
                            ColorView::Make(placed, Eigen::Vector3f(gain[0], gain[1], gain[2])));
    views_.push_front(std::make_shared<const ColorView>(std::move(made)));
    if (views_.size() > kColorViewsKept) views_.pop_back();
    return views_.front();
  }

  Status Update(size_t tile, RayTileCache* rays) {
    const std::vector<ImageId> views = ViewsOf(tile);
    std::vector<Eigen::Vector3d> centers;
    for (const ImageId id : views)
      centers.push_back(sources_.at(id).geometry.cam_from_world.Center());
    Eigen::AlignedBox3d around = boxes_[tile];
    around.min().array() -= ColoringReach(coloring_);
    around.max().array() += ColoringReach(coloring_);
    std::vector<uint32_t> between = TilesBetween(boxes_, around, centers);
    if (views.empty()) between = {static_cast<uint32_t>(tile)};
    const uint64_t version = VersionOfColors(tile, views, between);
    if (tiles_[tile].color_version == version) {
      ++count_.kept;
      return Status::Ok();
    }
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
    VEDUTA_ASSIGN_OR_RETURN(const VertexColors colors,
                            ColorVertices(own->mesh(), *scene, used, coloring_, pass_.pool));
    TileRecord record = tiles_[tile];
    record.color_version = version;
    const auto transaction = pass_.database.BeginTransaction();
    transaction->dense().PutSurface(
        SurfacePart::kColors, record.reconstruction, record.place,
        SerializeColors(record.mesh_version, colors.colors, colors.view_counts));
    transaction->dense().PutTile(record);
    ++count_.computed;
    return transaction->Commit();
  }

  const Pass& pass_;
  const std::shared_ptr<const Snapshot> snapshot_;  // meshes do not change in this stage
  ViewLoader loader_;
  ColoringOptions coloring_;
  std::map<ImageId, ColorSource> sources_;
  std::vector<TileRecord> tiles_;  // those with triangles; ascending places
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::shared_ptr<const RayDevice> ray_device_;
  std::list<std::shared_ptr<const ColorView>> views_;  // newest first
  StageCount count_;
};

}  // namespace

Result<StageCount> UpdateExposures(const Pass& pass) {
  Stopwatch watch;
  StageCount count;
  VEDUTA_RETURN_IF_ERROR(pass.Tell("exposures", 0, 1));
  VEDUTA_ASSIGN_OR_RETURN(auto depths, LoadDepths(pass));
  std::map<ImageId, Eigen::Vector3f> fixed;
  for (const auto& [id, depth] : depths) {
    if (HasGain(depth)) fixed[id] = Eigen::Vector3f(depth.gain[0], depth.gain[1], depth.gain[2]);
  }
  count.kept = fixed.size();
  if (fixed.size() == depths.size()) return count;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ColorObservation> observations, Observe(pass, depths));
  VEDUTA_ASSIGN_OR_RETURN(const auto gains, SolveExposures(observations, fixed, ExposureOptions()));
  const auto transaction = pass.database.BeginTransaction();
  for (auto& [id, depth] : depths) {
    if (HasGain(depth)) continue;
    const auto found = gains.find(id);
    const Eigen::Vector3f gain = found == gains.end() ? Eigen::Vector3f::Ones() : found->second;
    depth.gain = {gain.x(), gain.y(), gain.z()};
    transaction->dense().PutDepth(depth);
    ++count.computed;
  }
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  count.ms = watch.LapMs();
  return count;
}

Result<StageCount> ColorTiles(const Pass& pass) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(StageCount count, ColorStage(pass).Run());
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
