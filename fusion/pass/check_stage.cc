// SPDX-License-Identifier: Apache-2.0
// Depth maps against each other: what neighbouring key views confirm goes into the volume.
#include <algorithm>
#include <memory>
#include <string>

#include "fusion/depth/depth_codes.h"
#include "fusion/pass/movement.h"
#include "fusion/pass/range_images.h"
#include "fusion/pass/stage.h"
#include "fusion/pass/view_loader.h"
#include "fusion/volume/range_image.h"
#include "storage/base/lru_cache.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

class CheckStage final {
 public:
  CheckStage(const CheckStageOptions& options, const MovementTolerance& tolerance, DensePass* pass)
      : options_(options), tolerance_(tolerance), pass_(*pass), snapshot_(pass->GetSnapshot()) {}

  Result<StageCount> Run() {
    VEDUTA_RETURN_IF_ERROR(snapshot_->dense().ScanDepths([&](const DepthRecord& depth) {
      if (depth.reconstruction != pass_.reconstruction()) return true;
      const auto image = pass_.scene().images.find(depth.image);
      if (image == pass_.scene().images.end()) return true;
      depths_[depth.image] = depth;
      centers_[depth.image] = image->second.cam_from_world.Center();
      return true;
    }));
    size_t done = 0;
    for (const auto& [id, depth] : depths_) {
      VEDUTA_RETURN_IF_ERROR(pass_.Tell("checks", done++, depths_.size()));
      VEDUTA_RETURN_IF_ERROR(Update(depth));
    }
    VEDUTA_RETURN_IF_ERROR(pass_.Tell("checks", done, depths_.size()));
    return count_;
  }

 private:
  uint64_t VersionOfCheck(const CheckedDepthRecord& checked, uint64_t depth_version) const {
    VersionFeed feed(options_);
    feed << depth_version << checked.cam_from_world;
    for (const DepthVersion& neighbor : checked.neighbors)
      feed << neighbor.image << neighbor.version;
    return feed.Version();
  }

  // Key views with a depth map, best first: those that see the same points from angles at which
  // stereo works.
  Result<std::vector<ImageId>> RankNeighbors(const SceneImage& image) const {
    KeyView key{
        image.record.width_px, image.record.height_px, image.cam_from_world.Center(), {}, {}};
    const Pinhole camera(image.camera);
    for (const SceneObservation& o : image.observations) {
      const ScenePoint& point = pass_.scene().points[o.point];
      const Eigen::Vector3d x = image.cam_from_world * point.position;
      if (!(x.z() > 0)) continue;
      key.features.push_back(camera.Project(x));
      key.points.push_back({key.features.back(), point.position, point.track});
    }
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<SensorView> views,
                            RankSensorViews(key, centers_, options_.neighbors));
    std::vector<ImageId> ranked;
    for (const SensorView& view : views) {
      if (view.image != image.record.id) ranked.push_back(view.image);
    }
    return ranked;
  }

  // Those of last time, if there is one, stay; what is missing is filled with the best others.
  Result<std::vector<DepthVersion>> NeighborsOf(
      const SceneImage& image, const std::optional<CheckedDepthRecord>& last) const {
    std::vector<ImageId> chosen;
    if (last) {
      for (const DepthVersion& neighbor : last->neighbors) {
        if (depths_.contains(neighbor.image)) chosen.push_back(neighbor.image);
      }
    }
    if (chosen.size() < options_.neighbor_count) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> ranked, RankNeighbors(image));
      for (const ImageId other : ranked) {
        if (chosen.size() >= options_.neighbor_count) break;
        if (std::ranges::find(chosen, other) == chosen.end()) chosen.push_back(other);
      }
    }
    chosen.resize(std::min<size_t>(chosen.size(), options_.neighbor_count));
    std::vector<DepthVersion> neighbors;
    for (const ImageId other : chosen) neighbors.push_back({other, 0, depths_.at(other).version});
    return neighbors;
  }

  // The same neighbours, and no more than half of their maps were made anew since: what they say
  // has hardly changed.
  static bool IsCloseTo(const std::vector<DepthVersion>& then,
                        const std::vector<DepthVersion>& now) {
    const auto same_image = [](const DepthVersion& a, const DepthVersion& b) {
      return a.image == b.image;
    };
    if (!std::ranges::equal(then, now, same_image)) return false;
    size_t renewed = 0;
    for (size_t i = 0; i < then.size(); ++i) renewed += then[i].version != now[i].version;
    return 2 * renewed <= then.size();
  }

  bool HasMoved(const SceneImage& image, const CheckedDepthRecord& last) const {
    const double moved = MovedInWorld(PointsInCamera(pass_.scene(), image), last.cam_from_world,
                                      image.cam_from_world);
    return !(moved <= tolerance_.moved_voxels_max * options_.grid.voxel_size);
  }

  Result<std::shared_ptr<const DepthMap>> LoadMap(const DepthRecord& depth) {
    const auto load = [&]() -> Result<std::shared_ptr<const DepthMap>> {
      VEDUTA_ASSIGN_OR_RETURN(const DepthPixels pixels,
                              snapshot_->dense().GetDepthPixels(depth.image));
      VEDUTA_ASSIGN_OR_RETURN(DepthMap map, DecodeDepth(pixels, depth.width_px, depth.height_px,
                                                        {depth.depth_near, depth.depth_far}));
      return std::make_shared<const DepthMap>(std::move(map));
    };
    return maps_.GetOrMake(depth.image.value, load, [](const auto& map) {
      return 5 * uint64_t{map->width_px} * map->height_px;
    });
  }

  ViewGeometry GeometryOf(const DepthRecord& depth) const {
    ViewGeometry geometry{
        depth.width_px, depth.height_px, {}, pass_.scene().images.at(depth.image).cam_from_world};
    geometry.camera.fx = depth.fx, geometry.camera.fy = depth.fy;
    geometry.camera.cx = depth.cx, geometry.camera.cy = depth.cy;
    return geometry;
  }

  Status Update(const DepthRecord& depth) {
    const SceneImage& image = pass_.scene().images.at(depth.image);
    std::optional<CheckedDepthRecord> last;
    if (depth.checked_version != 0) {
      Result<CheckedDepthRecord> found =
          snapshot_->dense().GetCheckedDepth(depth.image, depth.checked_version);
      // One that is gone is made anew.
      if (found.status().code() != StatusCode::kNotFound) {
        VEDUTA_RETURN_IF_ERROR(found.status());
        last = *std::move(found);
      }
    }
    // Neighbours that other options or another algorithm chose, or that a former depth map was
    // checked against, are chosen anew.
    const bool is_like_last = last && last->version == VersionOfCheck(*last, depth.version);
    CheckedDepthRecord checked;
    VEDUTA_ASSIGN_OR_RETURN(
        checked.neighbors,
        NeighborsOf(image, is_like_last ? last : std::optional<CheckedDepthRecord>()));
    checked.cam_from_world = image.cam_from_world;
    const bool has_moved = !last || HasMoved(image, *last);
    if (!has_moved) checked.cam_from_world = last->cam_from_world;
    // What is kept was made from the neighbours' maps of that time, and its record says so.
    const bool is_kept =
        is_like_last && !has_moved && IsCloseTo(last->neighbors, checked.neighbors);
    if (is_kept) {
      ++count_.kept;
      return Status::Ok();
    }
    checked.version = VersionOfCheck(checked, depth.version);
    return Make(depth, std::move(checked));
  }

  Result<DepthMap> CheckAgainst(const DepthRecord& depth, const CheckedDepthRecord& checked) {
    VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const DepthMap> map, LoadMap(depth));
    std::vector<std::shared_ptr<const DepthMap>> held;
    std::vector<NeighborDepth> neighbors;
    for (const DepthVersion& neighbor : checked.neighbors) {
      VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const DepthMap> other,
                              LoadMap(depths_.at(neighbor.image)));
      neighbors.push_back({GeometryOf(depths_.at(neighbor.image)), other.get()});
      held.push_back(std::move(other));
    }
    return CheckConsistency(*map, GeometryOf(depth), neighbors, options_.consistency, pass_.pool());
  }

  Status Make(const DepthRecord& depth, CheckedDepthRecord checked) {
    VEDUTA_ASSIGN_OR_RETURN(const DepthMap kept, CheckAgainst(depth, checked));
    checked.image = depth.image;
    checked.reconstruction = depth.reconstruction;
    checked.width_px = depth.width_px, checked.height_px = depth.height_px;
    checked.fx = depth.fx, checked.fy = depth.fy, checked.cx = depth.cx, checked.cy = depth.cy;
    checked.depth_near = depth.depth_near, checked.depth_far = depth.depth_far;
    const DepthRange range{depth.depth_near, depth.depth_far};
    const DepthPixels pixels = EncodeDepth(kept, range);
    // As it will be read: the blocks are those that integration finds.
    VEDUTA_ASSIGN_OR_RETURN(const DepthMap read,
                            DecodeDepth(pixels, depth.width_px, depth.height_px, range));
    VEDUTA_ASSIGN_OR_RETURN(const RangeImage image,
                            RangeImage::Make(read, veduta::GeometryOf(checked)));
    for (const NamedBlock& named : image.BlocksNearSurface(options_.grid))
      checked.blocks.push_back({named.block, named.pixel_count});
    checked.known_count = static_cast<uint32_t>(
        std::ranges::count_if(pixels.codes, [](uint16_t code) { return code != 0; }));
    DepthRecord with_check = depth;
    with_check.checked_version = checked.version;
    VEDUTA_RETURN_IF_ERROR(
        pass_.Commit([&](const Snapshot& now, Transaction* transaction) -> Status {
          VEDUTA_RETURN_IF_ERROR(pass_.ExpectDepth(now, depth));
          transaction->dense().PutDepth(with_check);
          transaction->dense().PutCheckedDepth(checked, pixels);
          return Status::Ok();
        }));
    ++count_.computed;
    count_.units += checked.known_count;
    return Status::Ok();
  }

  const CheckStageOptions& options_;
  const MovementTolerance& tolerance_;
  DensePass& pass_;
  const std::shared_ptr<const Snapshot> snapshot_;  // raw depth maps do not change in this stage
  std::map<ImageId, DepthRecord> depths_;
  std::map<ImageId, Eigen::Vector3d> centers_;
  LruCache<uint32_t, std::shared_ptr<const DepthMap>> maps_{pass_.map_bytes_max()};  // by image
  StageCount count_;
};

}  // namespace

Result<StageCount> CheckDepths(const CheckStageOptions& options, const MovementTolerance& tolerance,
                               DensePass* pass) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(StageCount count, CheckStage(options, tolerance, pass).Run());
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
