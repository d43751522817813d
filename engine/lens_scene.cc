// SPDX-License-Identifier: Apache-2.0
#include "engine/lens_scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <utility>

#include "engine/camera/projection.h"
#include "engine/ingest/map_loader.h"
#include "engine/parts.h"
#include "storage/base/angle.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

// How far the principal point is thought to lie from the photo's middle, over the longer side: as
// LensDeviations (engine/mapping/unknown_camera.h).
constexpr double kPrincipalPointSigma = 0.007;
// That of photos that were cropped off their middle, and so many times of which it must lie off
// before that is believed. Of photos of castle-P19 and fountain-P11 that were cut off by up to 10 %
// it was 2 to 10 times, and focal lengths came out to 0.5 % instead of 0.1 %. Chosen by hand.
constexpr double kCroppedSigma = 0.05, kCroppedTimes = 2;
// Images that must see a point: two see no contradiction. Chosen by hand.
constexpr size_t kViewsMin = 3;
// Between two rays to a point, at least: how far points are that all images see from one side is
// not known, and makes the normal equations singular. Chosen by hand.
constexpr double kAngleDegMin = 1.5;
// Chosen points of each two images that share so many. Chosen by hand.
constexpr size_t kSharedPointsMin = 15;
// Chosen points that a view must see: 12 numbers and more for its 6. Chosen by hand.
constexpr size_t kObservationsMin = 12;
// An observation that is off by more than so many times the median is wrong: of normal errors one
// in 65,000 is. Chosen by hand.
constexpr double kMisfitTimes = 4;

// Views of a camera that are asked for a focal length of their own, at least. Of those that know it
// to such a share of itself one wants another one if it is so much off the median, and so many
// standard deviations; and so does the median, if it is so much off the common one. Views of one
// camera differed by 0.5 % on castle-P19, 1.3 % on fountain-P11 and 0.7 % on museum; of tourists'
// photos that were taken for one camera's by 25 %, and their median by 16 %. Chosen by hand.
constexpr size_t kFreedMin = 3;
constexpr double kFreedKnownShareMax = 0.05, kFreedOffMin = 0.05, kFreedDeviationsMin = 4;
// A camera did not take all of its views if more than such a share of them want another one.
constexpr double kFreedShareMax = 0.25;

// The points that most images see: of each two images some, so that what holds parts of the scene
// together is among them, then of all.
std::vector<PointId> ChoosePoints(const CityMap& map, std::span<const ImageId> images,
                                  uint32_t count_max) {
  std::vector<PointId> points = map.PointsSeenBy(images);
  std::erase_if(points, [&](PointId id) { return map.point(id).track.size() < kViewsMin; });
  std::ranges::stable_sort(points, std::greater<>(),
                           [&](PointId id) { return map.point(id).track.size(); });
  std::map<std::pair<ImageId, ImageId>, size_t> shared;  // chosen points of each two images
  std::vector<PointId> chosen, others;
  for (const PointId id : points) {
    std::vector<size_t*> counts;
    const std::vector<TrackElement>& track = map.point(id).track;
    for (size_t j = 1; j < track.size(); ++j) {
      for (size_t i = 0; i < j; ++i)
        counts.push_back(&shared[std::minmax(track[i].image, track[j].image)]);
    }
    const bool is_wanted =
        std::ranges::any_of(counts, [](const size_t* count) { return *count < kSharedPointsMin; });
    const bool is_chosen = is_wanted && chosen.size() < count_max;
    (is_chosen ? chosen : others).push_back(id);
    if (!is_chosen) continue;
    for (size_t* const count : counts) ++*count;
  }
  const size_t more = std::min(others.size(), count_max - chosen.size());
  chosen.insert(chosen.end(), others.begin(), others.begin() + static_cast<ptrdiff_t>(more));
  return chosen;
}

// Whether two of the views see the point under an angle that says how far it is.
bool HasAngle(const PlaneScene& scene, const Eigen::Vector3d& point,
              std::span<const PlaneObservation* const> seen) {
  const double cosine_max = std::cos(kAngleDegMin * kRadPerDeg);
  std::vector<Eigen::Vector3d> rays;
  for (const PlaneObservation* one : seen)
    rays.push_back((scene.cams_from_world[one->view].Center() - point).normalized());
  for (size_t j = 1; j < rays.size(); ++j) {
    for (size_t i = 0; i < j; ++i) {
      if (rays[i].dot(rays[j]) < cosine_max) return true;
    }
  }
  return false;
}

// Numbers what is kept anew, from 0; the others have none.
std::vector<uint32_t> NumberKept(const std::vector<size_t>& counts) {
  std::vector<uint32_t> numbers(counts.size());
  uint32_t next = 0;
  for (size_t i = 0; i < counts.size(); ++i) numbers[i] = counts[i] > 0 ? next++ : next;
  return numbers;
}

template <typename T>
void KeepCounted(const std::vector<size_t>& counts, std::vector<T>* all) {
  size_t i = 0;
  std::erase_if(*all, [&](const T&) { return counts[i++] == 0; });
}

Result<std::optional<AdjustedLens>> AdjustWith(LensScene scene, double principal_point_sigma,
                                               uint32_t views_min) {
  PlaneAdjustmentOptions options;
  options.is_planar = false;
  options.principal_point_sigma = principal_point_sigma;
  options.distortion_center_sigma = kPrincipalPointSigma;
  AdjustedLens adjusted{std::move(scene), {}};
  for (const bool is_last : {false, true}) {
    DropLoose(&adjusted.scene);
    if (adjusted.scene.photos.size() < views_min) return std::optional<AdjustedLens>();
    VEDUTA_ASSIGN_OR_RETURN(
        adjusted.made, AdjustPlane(adjusted.scene.observations, options, &adjusted.scene.scene));
    if (!is_last) DropMisfits(adjusted.made, &adjusted.scene);
  }
  return std::optional(std::move(adjusted));
}

// Whether a camera's photos want their principal point farther from their middle than it is thought
// to lie: something was cut off them at one side.
bool IsCropped(const PlaneScene& scene) {
  return std::ranges::any_of(scene.cameras, [](const CameraModel& c) {
    const double away_px =
        std::max(std::abs(c.cx - 0.5 * (c.width_px - 1)), std::abs(c.cy - 0.5 * (c.height_px - 1)));
    return away_px > kCroppedTimes * kPrincipalPointSigma * std::max(c.width_px, c.height_px);
  });
}

// The logarithm of the focal length that a view has by itself, and its standard deviation.
struct FreedFocal {
  double log, deviation;
};

bool IsManyLensed(double log_common, const std::vector<FreedFocal>& focals) {
  if (focals.size() < kFreedMin) return false;
  std::vector<double> logs, deviations;
  for (const FreedFocal& focal : focals) {
    logs.push_back(focal.log);
    deviations.push_back(focal.deviation);
  }
  const double median = MedianOf(std::move(logs)), deviation = MedianOf(std::move(deviations));
  const auto is_off = [](double difference, double sigma) {
    return std::abs(difference) > std::max(kFreedOffMin, kFreedDeviationsMin * sigma);
  };
  const auto off = std::ranges::count_if(
      focals, [&](const FreedFocal& focal) { return is_off(focal.log - median, focal.deviation); });
  return is_off(log_common - median, deviation) ||
         static_cast<double>(off) > kFreedShareMax * static_cast<double>(focals.size());
}

}  // namespace

Result<LensScene> ReadLensScene(const Engine& engine, std::vector<CameraModel> cameras,
                                uint32_t points_max) {
  const EngineParts& parts = EngineParts::Of(engine);
  const std::shared_ptr<const Snapshot> snapshot = parts.database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const auto reconstructions, snapshot->ListReconstructions());
  LensScene read;
  read.scene.cameras = std::move(cameras);
  read.cameras.resize(read.scene.cameras.size());
  std::iota(read.cameras.begin(), read.cameras.end(), 0);
  const ReconstructionRecord* largest = nullptr;
  for (const ReconstructionRecord& one : reconstructions) {
    if (one.is_living() && (largest == nullptr || one.image_count > largest->image_count))
      largest = &one;
  }
  if (largest == nullptr) return read;
  CityMap map;
  MapLoader loader(snapshot, &parts.caches->features, &map);
  std::vector<ImageId> images;
  VEDUTA_RETURN_IF_ERROR(loader.LoadReconstruction(largest->id, &images));
  std::map<ImageId, uint32_t> views;
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot->GetImage(id));
    views.try_emplace(id, static_cast<uint32_t>(views.size()));
    read.photos.push_back(static_cast<uint32_t>(std::stoul(image.name)));
    read.scene.cams_from_world.push_back(map.image(id).cam_from_world);
    read.scene.camera_of_view.push_back(image.camera.value - 1);
  }
  for (const PointId id : ChoosePoints(map, images, points_max)) {
    const auto point = static_cast<uint32_t>(read.scene.points.size());
    read.scene.points.push_back(map.point(id).position);
    for (const TrackElement& element : map.point(id).track) {
      const Keypoint& at = map.image(element.image).features->keypoints[element.feature];
      const uint32_t view = views.at(element.image);
      const CameraModel& camera = read.scene.cameras[read.scene.CameraOf(view)];
      read.observations.push_back({view, point, DistortPixel(camera, {at.x_px, at.y_px}), 1});
    }
  }
  return read;
}

void DropLoose(LensScene* scene) {
  std::vector<PlaneObservation>& all = scene->observations;
  for (bool is_settled = false; !is_settled;) {
    const size_t before = all.size();
    std::vector<std::vector<const PlaneObservation*>> of_point(scene->scene.points.size());
    for (const PlaneObservation& one : all) of_point[one.point].push_back(&one);
    std::vector<bool> is_held(of_point.size());
    std::vector<size_t> of_view(scene->photos.size());
    for (size_t p = 0; p < of_point.size(); ++p) {
      is_held[p] = of_point[p].size() >= kViewsMin &&
                   HasAngle(scene->scene, scene->scene.points[p], of_point[p]);
      if (!is_held[p]) continue;
      for (const PlaneObservation* one : of_point[p]) ++of_view[one->view];
    }
    std::erase_if(all, [&](const PlaneObservation& one) {
      return !is_held[one.point] || of_view[one.view] < kObservationsMin;
    });
    is_settled = all.size() == before;
  }
  std::vector<size_t> of_point(scene->scene.points.size()), of_view(scene->photos.size());
  for (const PlaneObservation& one : all) ++of_point[one.point], ++of_view[one.view];
  const std::vector<uint32_t> points = NumberKept(of_point), views = NumberKept(of_view);
  for (PlaneObservation& one : all) one.point = points[one.point], one.view = views[one.view];
  KeepCounted(of_point, &scene->scene.points);
  KeepCounted(of_view, &scene->scene.cams_from_world);
  KeepCounted(of_view, &scene->photos);
  if (scene->scene.camera_of_view.empty()) return;
  KeepCounted(of_view, &scene->scene.camera_of_view);
  std::vector<size_t> of_camera(scene->cameras.size());
  for (const uint32_t camera : scene->scene.camera_of_view) ++of_camera[camera];
  const std::vector<uint32_t> cameras = NumberKept(of_camera);
  for (uint32_t& camera : scene->scene.camera_of_view) camera = cameras[camera];
  KeepCounted(of_camera, &scene->scene.cameras);
  KeepCounted(of_camera, &scene->cameras);
}

void DropMisfits(const PlaneAdjustment& made, LensScene* scene) {
  std::vector<double> errors_px;
  for (const Eigen::Vector2d& residual : made.residuals_px) errors_px.push_back(residual.norm());
  const double error_px_max = kMisfitTimes * MedianOf(errors_px);
  size_t i = 0;
  std::erase_if(scene->observations,
                [&](const PlaneObservation&) { return errors_px[i++] > error_px_max; });
}

double AdjustedLens::FocalShare(size_t camera) const {
  return std::sqrt(made.covariances[camera](0, 0)) / scene.scene.cameras[camera].fx;
}

Result<std::optional<AdjustedLens>> AdjustLens(LensScene scene, uint32_t views_min) {
  VEDUTA_ASSIGN_OR_RETURN(std::optional<AdjustedLens> adjusted,
                          AdjustWith(scene, kPrincipalPointSigma, views_min));
  if (!adjusted || !IsCropped(adjusted->scene.scene)) return adjusted;
  return AdjustWith(std::move(scene), kCroppedSigma, views_min);
}

Result<std::vector<uint32_t>> ListManyLensed(const LensScene& adjusted, uint32_t views_min) {
  std::vector<uint32_t> many;
  std::vector<size_t> views(adjusted.scene.cameras.size());
  for (size_t view = 0; view < adjusted.photos.size(); ++view)
    ++views[adjusted.scene.CameraOf(view)];
  if (std::ranges::all_of(views, [](size_t count) { return count < kFreedMin; })) return many;
  LensScene freed = adjusted;
  freed.scene.cameras.clear(), freed.cameras.clear(), freed.scene.camera_of_view.clear();
  for (uint32_t view = 0; view < adjusted.photos.size(); ++view) {
    const uint32_t camera = adjusted.scene.CameraOf(view);
    freed.scene.camera_of_view.push_back(view);
    freed.scene.cameras.push_back(adjusted.scene.cameras[camera]);
    freed.cameras.push_back(adjusted.cameras[camera]);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<AdjustedLens> made,
                          AdjustLens(std::move(freed), views_min));
  if (!made || !made->made.is_determined) return many;
  std::map<uint32_t, std::vector<FreedFocal>> of_cameras;
  for (size_t i = 0; i < made->scene.cameras.size(); ++i) {
    const double deviation = made->FocalShare(i);
    if (deviation <= kFreedKnownShareMax)
      of_cameras[made->scene.cameras[i]].push_back(
          {std::log(made->scene.scene.cameras[i].fx), deviation});
  }
  for (size_t i = 0; i < adjusted.cameras.size(); ++i) {
    const auto freed_focals = of_cameras.find(adjusted.cameras[i]);
    if (freed_focals != of_cameras.end() &&
        IsManyLensed(std::log(adjusted.scene.cameras[i].fx), freed_focals->second))
      many.push_back(adjusted.cameras[i]);
  }
  std::ranges::sort(many);
  return many;
}

}  // namespace veduta
