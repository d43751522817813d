// SPDX-License-Identifier: Apache-2.0
// Depth maps against each other: what neighbouring key views confirm goes into the volume.
#include <algorithm>
#include <list>
#include <string>

#include "fusion/depth/depth_codes.h"
#include "fusion/pass/movement.h"
#include "fusion/pass/pass.h"
#include "fusion/pass/view_loader.h"
#include "fusion/volume/range_image.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

constexpr size_t kMapsKept = 24;

// Neighbours need little overlap and less of an angle than sensor views: their own depth is what
// they say.
SensorViewOptions NeighborOptions() {
  SensorViewOptions options;
  options.overlap_min = 0.1;
  return options;
}

class CheckStage final {
 public:
  explicit CheckStage(const Pass& pass) : pass_(pass), snapshot_(pass.database.GetSnapshot()) {}

  Result<StageCount> Run() {
    VEDUTA_RETURN_IF_ERROR(snapshot_->dense().ScanDepths([&](const DepthRecord& depth) {
      if (depth.reconstruction != pass_.scene.reconstruction.id) return true;
      const auto image = pass_.scene.images.find(depth.image);
      if (image == pass_.scene.images.end()) return true;
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
    VersionFeed feed("check");
    feed << depth_version << checked.cam_from_world << pass_.settings.voxel_size;
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
      const ScenePoint& point = pass_.scene.points[o.point];
      const Eigen::Vector3d x = image.cam_from_world * point.position;
      if (!(x.z() > 0)) continue;
      key.features.push_back(camera.Project(x));
      key.points.push_back({key.features.back(), point.position, point.track});
    }
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<SensorView> views,
                            RankSensorViews(key, centers_, NeighborOptions()));
    std::vector<ImageId> ranked;
    for (const SensorView& view : views) {
      if (view.image != image.record.id) ranked.push_back(view.image);
    }
    return ranked;
  }

  // Those of last time stay; what is missing is filled with the best others.
  Result<std::vector<DepthVersion>> NeighborsOf(
      const SceneImage& image, const std::optional<CheckedDepthRecord>& last) const {
    std::vector<ImageId> chosen;
    if (last) {
      for (const DepthVersion& neighbor : last->neighbors) {
        if (depths_.contains(neighbor.image)) chosen.push_back(neighbor.image);
      }
    }
    if (chosen.size() < pass_.options.neighbor_count) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> ranked, RankNeighbors(image));
      for (const ImageId other : ranked) {
        if (chosen.size() >= pass_.options.neighbor_count) break;
        if (std::ranges::find(chosen, other) == chosen.end()) chosen.push_back(other);
      }
    }
    chosen.resize(std::min<size_t>(chosen.size(), pass_.options.neighbor_count));
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

  Result<std::shared_ptr<const DepthMap>> LoadMap(const DepthRecord& depth) {
    for (auto it = maps_.begin(); it != maps_.end(); ++it) {
      if (it->first != depth.image) continue;
      maps_.splice(maps_.begin(), maps_, it);
      return maps_.front().second;
    }
    VEDUTA_ASSIGN_OR_RETURN(const DepthPixels pixels,
                            snapshot_->dense().GetDepthPixels(depth.image));
    VEDUTA_ASSIGN_OR_RETURN(DepthMap map, DecodeDepth(pixels, depth.width_px, depth.height_px,
                                                      {depth.depth_near, depth.depth_far}));
    maps_.emplace_front(depth.image, std::make_shared<const DepthMap>(std::move(map)));
    if (maps_.size() > kMapsKept) maps_.pop_back();
    return maps_.front().second;
  }

  ViewGeometry GeometryOf(const DepthRecord& depth) const {
    ViewGeometry geometry{
        depth.width_px, depth.height_px, {}, pass_.scene.images.at(depth.image).cam_from_world};
    geometry.camera.fx = depth.fx, geometry.camera.fy = depth.fy;
    geometry.camera.cx = depth.cx, geometry.camera.cy = depth.cy;
    return geometry;
  }

  Status Update(const DepthRecord& depth) {
    const SceneImage& image = pass_.scene.images.at(depth.image);
    std::optional<CheckedDepthRecord> last;
    if (depth.checked_version != 0) {
      VEDUTA_ASSIGN_OR_RETURN(
          last, snapshot_->dense().GetCheckedDepth(depth.image, depth.checked_version));
    }
    CheckedDepthRecord checked;
    VEDUTA_ASSIGN_OR_RETURN(checked.neighbors, NeighborsOf(image, last));
    if (last && IsCloseTo(last->neighbors, checked.neighbors)) checked.neighbors = last->neighbors;
    checked.cam_from_world = image.cam_from_world;
    if (last) {
      const double moved = MovedInWorld(PointsInCamera(pass_.scene, image), last->cam_from_world,
                                        image.cam_from_world);
      if (moved <= pass_.options.moved_voxels_max * pass_.settings.voxel_size) {
        checked.cam_from_world = last->cam_from_world;
      }
    }
    checked.version = VersionOfCheck(checked, depth.version);
    if (last && last->version == checked.version) {
      ++count_.kept;
      return Status::Ok();
    }
    return Make(depth, std::move(checked));
  }

  Status Make(DepthRecord depth, CheckedDepthRecord checked) {
    VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const DepthMap> map, LoadMap(depth));
    std::vector<std::shared_ptr<const DepthMap>> held;
    std::vector<NeighborDepth> neighbors;
    for (const DepthVersion& neighbor : checked.neighbors) {
      VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const DepthMap> other,
                              LoadMap(depths_.at(neighbor.image)));
      neighbors.push_back({GeometryOf(depths_.at(neighbor.image)), other.get()});
      held.push_back(std::move(other));
    }
    VEDUTA_ASSIGN_OR_RETURN(
        const DepthMap kept,
        CheckConsistency(*map, GeometryOf(depth), neighbors, ConsistencyOptions(), pass_.pool));
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
    ViewGeometry geometry = GeometryOf(depth);
    geometry.cam_from_world = checked.cam_from_world;
    VEDUTA_ASSIGN_OR_RETURN(const RangeImage image, RangeImage::Make(read, geometry));
    for (const NamedBlock& named : image.BlocksNearSurface(pass_.grid())) {
      checked.blocks.push_back({{named.block.x, named.block.y, named.block.z}, named.pixel_count});
    }
    checked.known_count = static_cast<uint32_t>(
        std::ranges::count_if(pixels.codes, [](uint16_t code) { return code != 0; }));
    depth.checked_version = checked.version;
    const auto transaction = pass_.database.BeginTransaction();
    transaction->dense().PutDepth(depth);
    transaction->dense().PutCheckedDepth(checked, pixels);
    VEDUTA_RETURN_IF_ERROR(transaction->Commit());
    ++count_.computed;
    count_.units += checked.known_count;
    return Status::Ok();
  }

  const Pass& pass_;
  const std::shared_ptr<const Snapshot> snapshot_;  // raw depth maps do not change in this stage
  std::map<ImageId, DepthRecord> depths_;
  std::map<ImageId, Eigen::Vector3d> centers_;
  std::list<std::pair<ImageId, std::shared_ptr<const DepthMap>>> maps_;  // newest first
  StageCount count_;
};

}  // namespace

Result<StageCount> CheckDepths(const Pass& pass) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(StageCount count, CheckStage(pass).Run());
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
