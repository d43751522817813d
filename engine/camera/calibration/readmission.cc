// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/readmission.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/camera/calibration/metric_initialization.h"
#include "engine/camera/calibration/plane_pose.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

// The largest error of a point that agrees, over the longer side: 8 px of 1600. Chosen by hand; not
// measured.
constexpr double kErrorMax = 0.005;

std::optional<Eigen::Vector2d> Normalized(const CameraModel& camera, const Eigen::Vector2d& px) {
  const auto undistorted = UndistortPixel(camera, px);
  if (!undistorted) return std::nullopt;
  return Eigen::Vector2d((undistorted->x() - camera.cx) / camera.fx,
                         (undistorted->y() - camera.cy) / camera.fy);
}

}  // namespace

void PlaceWhatWasLeftOut(const std::vector<PlaneObservation>& observations,
                         const ObservationChoice& choice, const std::vector<std::string>& never,
                         PlaneScene* scene) {
  std::vector<bool> view_is_used(scene->cams_from_world.size()),
      point_is_used(scene->points.size());
  for (size_t i = 0; i < observations.size(); ++i) {
    if (choice.is_used[i])
      view_is_used[observations[i].view] = point_is_used[observations[i].point] = true;
  }
  const CameraModel& camera = scene->camera();
  const double error_max = kErrorMax * std::max(camera.width_px, camera.height_px) / camera.fx;
  for (uint32_t v = 0; v < view_is_used.size(); ++v) {
    if (view_is_used[v] || !never[v].empty()) continue;
    std::vector<Eigen::Vector2d> plane, seen;
    for (const PlaneObservation& o : observations) {
      if (o.view != v || !point_is_used[o.point]) continue;
      const auto x = Normalized(camera, o.px);
      if (!x) continue;
      plane.push_back(scene->points[o.point].head<2>());
      seen.push_back(*x);
    }
    if (const auto pose = EstimatePlanePose(plane, seen, error_max, v))
      scene->cams_from_world[v] = pose->cam_from_world;
  }

  std::vector<std::vector<Eigen::Vector2d>> places(scene->points.size());
  std::vector<double> distances(scene->points.size(), 0);  // of the farthest camera
  for (const PlaneObservation& o : observations) {
    const Rigid3& pose = scene->cams_from_world[o.view];
    if (point_is_used[o.point] || !never[o.view].empty() || !pose.translation.allFinite()) continue;
    const auto x = Normalized(camera, o.px);
    if (!x) continue;
    const Rigid3 world_from_cam = pose.Inverse();
    const Eigen::Vector3d ray = world_from_cam.rotation * x->homogeneous();
    const double along = -world_from_cam.translation.z() / ray.z();
    if (!(along > 0) || !std::isfinite(along)) continue;
    places[o.point].push_back((world_from_cam.translation + along * ray).head<2>());
    distances[o.point] = std::max(distances[o.point], along);
  }
  for (size_t p = 0; p < places.size(); ++p) {
    if (const auto place = Consensus(places[p], 2 * error_max * distances[p]))
      scene->points[p] << *place, 0;
  }
}

}  // namespace veduta
