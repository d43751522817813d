// SPDX-License-Identifier: Apache-2.0
// Raw depth maps: which are stale, and those made anew.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "engine/photo/derived_features.h"
#include "fusion/depth/depth_codes.h"
#include "fusion/pass/movement.h"
#include "fusion/pass/stage.h"
#include "fusion/pass/view_loader.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// What is filled in the photo has no depth.
void ForgetFilled(const View& view, DepthPixels* pixels) {
  for (size_t i = 0; i < view.filled.size(); ++i) {
    if (view.filled[i] != 0) pixels->codes[i] = pixels->confidence[i] = 0;
  }
}

class DepthStage final {
 public:
  DepthStage(const DepthStageOptions& options, const MovementTolerance& tolerance, DensePass* pass,
             std::vector<PassedOver>* without_depth)
      : options_(options),
        tolerance_(tolerance),
        pass_(*pass),
        without_depth_(without_depth),
        loader_(pass->GetSnapshot(), options.side_px, pass->map_bytes_max(), pass->views()) {
    for (const auto& [id, image] : pass->scene().images)
      centers_[id] = image.cam_from_world.Center();
  }

  Result<StageCount> Run() {
    VEDUTA_RETURN_IF_ERROR(DropStrangers());
    size_t done = 0;
    for (const auto& [id, image] : pass_.scene().images) {
      VEDUTA_RETURN_IF_ERROR(pass_.Tell("depth maps", done++, pass_.scene().images.size()));
      VEDUTA_RETURN_IF_ERROR(Update(image));
    }
    VEDUTA_RETURN_IF_ERROR(pass_.Tell("depth maps", done, pass_.scene().images.size()));
    return count_;
  }

 private:
  // Deletes the maps of photos that have no pose in the reconstruction any more: those of a pass
  // that was at work on them when they lost it.
  Status DropStrangers() {
    std::vector<ImageId> strangers;
    VEDUTA_RETURN_IF_ERROR(pass_.GetSnapshot()->dense().ScanDepths([&](const DepthRecord& depth) {
      const bool is_own = depth.reconstruction == pass_.reconstruction();
      if (is_own && !pass_.scene().images.contains(depth.image)) strangers.push_back(depth.image);
      return true;
    }));
    if (strangers.empty()) return Status::Ok();
    count_.removed += strangers.size();
    return pass_.Commit([&](const Snapshot&, Transaction* transaction) {
      for (const ImageId id : strangers) transaction->dense().DeleteDepth(id);
      return Status::Ok();
    });
  }

  // Of what a depth map is made from, as its record says it; 0 when a view that it names is gone.
  uint64_t VersionOfDepth(const DepthRecord& depth) const {
    VersionFeed feed(options_);
    feed << depth.width_px << depth.height_px << depth.fx << depth.fy << depth.cx << depth.cy
         << depth.cam_from_world << depth.depth_near << depth.depth_far;
    const auto add = [&](ImageId id) {
      const auto found = pass_.scene().images.find(id);
      if (found == pass_.scene().images.end()) return false;
      const CameraModel& m = found->second.camera;
      feed << found->second.record.photo << m.fx << m.fy << m.cx << m.cy << m.k1 << m.k2 << m.u0
           << m.v0;
      return true;
    };
    if (!add(depth.image)) return 0;
    for (const SensorPose& sensor : depth.sensors) {
      if (!add(sensor.image)) return 0;
      feed << sensor.cam_from_world;
    }
    return feed.Version();
  }

  // Whether the stored map may stay: made by this program with these settings, from views that have
  // hardly moved since against each other.
  bool IsCurrent(const DepthRecord& depth, const SceneImage& image) const {
    const ViewGeometry geometry = ViewGeometryOf(image, options_.side_px);
    const uint64_t version = VersionOfDepth(depth);
    if (depth.reconstruction != pass_.reconstruction() || version == 0 || depth.version != version)
      return false;
    if (depth.width_px != geometry.width_px || depth.height_px != geometry.height_px) return false;
    if (depth.sensors.size() != options_.sensor_count)
      return false;  // fewer: there may be more by now
    for (const SensorPose& sensor : depth.sensors) {
      const SceneImage& other = pass_.scene().images.at(sensor.image);
      const Rigid3 now = other.cam_from_world * image.cam_from_world.Inverse();
      const Rigid3 then = sensor.cam_from_world * depth.cam_from_world.Inverse();
      const ViewGeometry seen_by = ViewGeometryOf(other, options_.side_px);
      if (MovedPx(PointsInCamera(pass_.scene(), image), seen_by.camera, then, now) >
          tolerance_.moved_px_max) {
        return false;
      }
    }
    return true;
  }

  Result<std::vector<SensorView>> Rank(const SceneImage& image) {
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera,
                            loader_.snapshot().GetCamera(image.record.camera));
    VEDUTA_ASSIGN_OR_RETURN(const Features features,
                            ReadOrDeriveFeatures(loader_.snapshot(), image.record, camera,
                                                 &loader_.tables(), pass_.views().decoder));
    KeyView key{
        image.record.width_px, image.record.height_px, image.cam_from_world.Center(), {}, {}};
    key.features.reserve(features.size());
    for (const Keypoint& k : features.keypoints) key.features.emplace_back(k.x_px, k.y_px);
    for (const SceneObservation& o : image.observations) {
      if (o.feature >= features.size()) {
        return Status::Corruption("image " + image.record.name +
                                  " observes by a feature that it does not have");
      }
      const ScenePoint& point = pass_.scene().points[o.point];
      key.points.push_back({key.features[o.feature], point.position, point.track});
    }
    return RankSensorViews(key, centers_, options_.sensor_views);
  }

  // What the map would be made from; without sensors, and with the reason, where there is nothing
  // to make it from.
  Result<DepthRecord> Plan(const SceneImage& image, std::string* reason) {
    DepthRecord plan;
    plan.image = image.record.id;
    plan.reconstruction = pass_.reconstruction();
    plan.geometry_version = pass_.scene().reconstruction.geometry_version;
    plan.cam_from_world = image.cam_from_world;
    const ViewGeometry geometry = ViewGeometryOf(image, options_.side_px);
    plan.width_px = geometry.width_px, plan.height_px = geometry.height_px;
    plan.fx = geometry.camera.fx, plan.fy = geometry.camera.fy;
    plan.cx = geometry.camera.cx, plan.cy = geometry.camera.cy;
    std::vector<double> depths;
    for (const SceneObservation& o : image.observations) {
      depths.push_back((image.cam_from_world * pass_.scene().points[o.point].position).z());
    }
    const Result<DepthRange> range = DepthRangeOf(std::move(depths), options_.depth_margin);
    if (!range.ok()) {
      *reason = range.status().message();
      return plan;
    }
    plan.depth_near = range->near, plan.depth_far = range->far;
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<SensorView> views, Rank(image));
    for (const SensorView& view : views) {
      if (plan.sensors.size() == options_.sensor_count) break;
      if (damaged_.contains(view.image)) continue;
      plan.sensors.push_back({view.image, pass_.scene().images.at(view.image).cam_from_world});
    }
    if (plan.sensors.empty()) *reason = "no other photo overlaps enough";
    if (!plan.sensors.empty()) plan.version = VersionOfDepth(plan);
    return plan;
  }

  Status Update(const SceneImage& image) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<DepthRecord> stored,
                            pass_.GetSnapshot()->dense().FindDepth(image.record.id));
    if (stored && IsCurrent(*stored, image)) {
      ++count_.kept;
      return Status::Ok();
    }
    std::string reason;
    const Result<DepthRecord> planned = Plan(image, &reason);
    // What is damaged keeps no other photo from its depth map; a map that is there stays.
    if (planned.status().code() == StatusCode::kCorruption)
      return PassOver(image, planned.status().message(), /*is_stored=*/false);
    VEDUTA_RETURN_IF_ERROR(planned.status());
    DepthRecord plan = *planned;
    if (plan.sensors.empty()) return PassOver(image, reason, stored.has_value());
    if (stored && stored->version ==
                      plan.version) {  // it has fewer sensors than asked for, and there are no more
      ++count_.kept;
      return Status::Ok();
    }
    if (stored && stored->reconstruction == plan.reconstruction) {
      plan.checked_version = stored->checked_version;
      plan.gain = stored->gain;
      plan.exposure_version = stored->exposure_version;
    }
    return Make(image, std::move(plan), stored);
  }

  Status PassOver(const SceneImage& image, const std::string& reason, bool is_stored) {
    without_depth_->push_back({image.record.id, image.record.name, reason});
    if (!is_stored) return Status::Ok();
    ++count_.removed;
    return pass_.Commit([&](const Snapshot&, Transaction* transaction) {
      transaction->dense().DeleteDepth(image.record.id);
      return Status::Ok();
    });
  }

  Status Make(const SceneImage& image, DepthRecord plan, const std::optional<DepthRecord>& stored) {
    const Result<std::shared_ptr<const View>> key = loader_.Load(image);
    if (key.status().code() == StatusCode::kCorruption)
      return PassOver(image, key.status().message(), /*is_stored=*/false);
    VEDUTA_RETURN_IF_ERROR(key.status());
    std::vector<View> sensors;
    for (const SensorPose& sensor : plan.sensors) {
      VEDUTA_RETURN_IF_ERROR(pass_.CheckStop());  // each is a photo to decode
      const Result<std::shared_ptr<const View>> view =
          loader_.Load(pass_.scene().images.at(sensor.image));
      if (view.status().code() == StatusCode::kCorruption) {
        damaged_.insert(sensor.image);
        return Update(image);  // by others, of which there are fewer now
      }
      VEDUTA_RETURN_IF_ERROR(view.status());
      sensors.push_back(**view);
    }
    const DepthRange range{plan.depth_near, plan.depth_far};
    const MemoryBudget::Share share =
        pass_.TakeMemory(DepthVolumeBytes((*key)->geometry, options_.estimation));
    const Result<DepthMap> map = EstimateDepth(**key, sensors, range, options_.estimation,
                                               pass_.device(), pass_.pool(), pass_.stop());
    // It is made again by the next pass.
    if (map.status().code() == StatusCode::kCancelled) return pass_.CheckStop();
    // A view that nothing can be made of must not keep the city from its surface.
    if (map.status().code() == StatusCode::kInvalidArgument)
      return PassOver(image, map.status().message(), stored.has_value());
    VEDUTA_RETURN_IF_ERROR(map.status());
    DepthPixels pixels = EncodeDepth(*map, range);
    ForgetFilled(**key, &pixels);
    plan.known_count = static_cast<uint32_t>(
        std::ranges::count_if(pixels.codes, [](uint16_t code) { return code != 0; }));
    VEDUTA_RETURN_IF_ERROR(
        pass_.Commit([&](const Snapshot& now, Transaction* transaction) -> Status {
          VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, now.FindPose(plan.image));
          if (!pose || pose->reconstruction != plan.reconstruction) return pass_.NoteOvertaken();
          if (stored) VEDUTA_RETURN_IF_ERROR(pass_.ExpectDepth(now, *stored));
          transaction->dense().PutDepth(plan);
          transaction->dense().PutDepthPixels(plan.image, pixels);
          return Status::Ok();
        }));
    ++count_.computed;
    count_.units += plan.known_count;
    return Status::Ok();
  }

  const DepthStageOptions& options_;
  const MovementTolerance& tolerance_;
  DensePass& pass_;
  std::vector<PassedOver>* const without_depth_;
  ViewLoader loader_;
  std::map<ImageId, Eigen::Vector3d> centers_;
  std::set<ImageId> damaged_;  // photos that cannot be read
  StageCount count_;
};

}  // namespace

Result<StageCount> UpdateDepths(const DepthStageOptions& options,
                                const MovementTolerance& tolerance, DensePass* pass,
                                std::vector<PassedOver>* without_depth) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(StageCount count,
                          DepthStage(options, tolerance, pass, without_depth).Run());
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
