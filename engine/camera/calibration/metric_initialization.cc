// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/metric_initialization.h"

#include <Eigen/Dense>
#include <algorithm>
#include <map>

#include "engine/camera/calibration/focal_search.h"
#include "engine/camera/calibration/plane_pose.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// For each point: the places on the plane where the views that have a pose saw it.
using Sightings = std::vector<std::vector<Eigen::Vector2d>>;

void AddSightings(const PlanarView& view, const Rigid3& cam_from_world, double focal,
                  Sightings* sightings) {
  const Rigid3 world_from_cam = cam_from_world.Inverse();
  for (const PlanarPoint& p : view) {
    const Eigen::Vector3d ray = world_from_cam.rotation * (p.x / focal).homogeneous();
    const double along = -world_from_cam.translation.z() / ray.z();
    if (!(along > 0) || !std::isfinite(along)) continue;  // at or above the horizon
    (*sightings)[p.point].push_back((world_from_cam.translation + along * ray).head<2>());
  }
}

Rigid3 RootPose(const Eigen::Vector3d& normal_in_cam) {
  const Eigen::Vector3d z = -normal_in_cam;  // the world's, towards the camera
  const Eigen::Vector3d x = z.unitOrthogonal();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << x, z.cross(x), z;
  return {Eigen::Quaterniond(cam_from_world).normalized(), normal_in_cam};
}

}  // namespace

std::optional<Eigen::Vector2d> Consensus(const std::vector<Eigen::Vector2d>& places,
                                         double distance_max) {
  std::optional<Eigen::Vector2d> best;
  size_t best_count = 0;
  for (const Eigen::Vector2d& center : places) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    size_t count = 0;
    for (const Eigen::Vector2d& other : places) {
      if ((other - center).norm() < distance_max) sum += other, ++count;
    }
    if (count > best_count) best_count = count, best = sum / static_cast<double>(count);
  }
  return best;
}

Status MetricOptions::Check() const {
  return OptionBounds()
      .FiniteAbove("error_max", error_max, 0)
      .AtLeast("agreeing_count_min", agreeing_count_min, 6)
      .AboveUpTo("agreeing_share_min", agreeing_share_min, 0, 1)
      .status();
}

MetricReconstruction InitializeMetric(const std::vector<PlanarView>& views, const ViewTree& tree,
                                      double focal, const MetricOptions& options) {
  const Status status = options.Check();
  VEDUTA_CHECK(status.ok(), status.message());
  MetricReconstruction made;
  made.cams_from_world.resize(views.size());
  uint32_t point_count = 0;
  for (const PlanarView& view : views) {
    if (!view.empty()) point_count = std::max(point_count, view.back().point + 1);
  }
  made.points.resize(point_count);
  if (tree.order.size() < 2) return made;

  std::vector<Eigen::Matrix3d> from_root;
  for (const uint32_t v : tree.order) {
    if (v != tree.root) from_root.push_back(tree.ViewFromRoot(v));
  }
  Sightings sightings(point_count);
  // An error in the image becomes larger on the plane, with the distance, which is about 1, and
  // with the slant. The factor of 2 for the slant is chosen by hand; not measured.
  const double distance_max = 2 * options.error_max / focal;
  const auto place = [&](uint32_t view, const Rigid3& pose) {
    made.cams_from_world[view] = pose;
    AddSightings(views[view], pose, focal, &sightings);
    for (const PlanarPoint& p : views[view])
      made.points[p.point] = Consensus(sightings[p.point], distance_max);
  };
  place(tree.root, RootPose(AgreedNormal(from_root, focal)));

  std::vector<bool> is_done(views.size(), false);
  is_done[tree.root] = true;
  for (;;) {
    uint32_t next = kNoView;
    size_t most = 0;
    for (const uint32_t v : tree.order) {
      const auto known = static_cast<size_t>(
          std::count_if(views[v].begin(), views[v].end(),
                        [&](const PlanarPoint& p) { return made.points[p.point].has_value(); }));
      if (!is_done[v] && known > most) most = known, next = v;
    }
    if (next == kNoView) return made;
    is_done[next] = true;
    std::vector<Eigen::Vector2d> plane, x;
    for (const PlanarPoint& p : views[next]) {
      if (!made.points[p.point]) continue;
      plane.push_back(*made.points[p.point]);
      x.push_back(p.x / focal);
    }
    const auto pose = EstimatePlanePose(plane, x, options.error_max / focal, next);
    if (!pose || pose->inliers.size() < options.agreeing_count_min) continue;
    if (static_cast<double>(pose->inliers.size()) <
        options.agreeing_share_min * static_cast<double>(x.size()))
      continue;
    place(next, pose->cam_from_world);
  }
}

}  // namespace veduta
