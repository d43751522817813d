// SPDX-License-Identifier: Apache-2.0
#pragma once
// Depth maps of a sphere in front of a plane, exact or noisy, for tests of the volume.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "fusion/volume/range_image.h"
#include "storage/base/content_hash.h"

namespace veduta::synthetic {

// World: z up, in metres. A scene is what a ray meets first.
struct Shapes {
  Eigen::Vector3d center = {0, 0, 0};
  double radius = 0;              // 0: no sphere
  std::optional<double> plane_y;  // the wall y = plane_y, seen from below it in y
};

inline double DistanceToSphere(const Shapes& shapes, const Eigen::Vector3d& point) {
  return (point - shapes.center).norm() - shapes.radius;
}

inline double Trace(const Shapes& shapes, const Eigen::Vector3d& from,
                    const Eigen::Vector3d& direction) {
  double nearest = 0;
  const auto offer = [&](double at) {
    if (at > 0 && (nearest == 0 || at < nearest)) nearest = at;
  };
  if (shapes.plane_y && direction.y() > 0) offer((*shapes.plane_y - from.y()) / direction.y());
  if (shapes.radius > 0) {
    const Eigen::Vector3d to = from - shapes.center;
    const double a = direction.squaredNorm(), b = to.dot(direction),
                 c = to.squaredNorm() - shapes.radius * shapes.radius;
    if (b * b > a * c) offer((-b - std::sqrt(b * b - a * c)) / a);
  }
  return nearest;
}

// A camera at `center` that looks at `target`, its x axis level.
inline ViewGeometry LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target,
                           uint32_t width, uint32_t height) {
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d up =
      std::abs(z.z()) > 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d x = z.cross(up).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world.row(0) = x;
  cam_from_world.row(1) = z.cross(x);
  cam_from_world.row(2) = z;
  ViewGeometry geometry;
  geometry.width_px = width;
  geometry.height_px = height;
  geometry.camera.fx = geometry.camera.fy = 0.9 * width;
  geometry.camera.cx = (width - 1) / 2.0;
  geometry.camera.cy = (height - 1) / 2.0;
  geometry.cam_from_world.rotation = Eigen::Quaterniond(cam_from_world);
  geometry.cam_from_world.translation = -(cam_from_world * center);
  return geometry;
}

// noise: sigma of depth relative to it; outliers: share of pixels with a depth between half and all
// of the true one.
inline DepthMap Render(const Shapes& shapes, const ViewGeometry& geometry, double noise,
                       double outliers, uint64_t seed) {
  SeededRandom random(seed);
  DepthMap map;
  map.width_px = geometry.width_px;
  map.height_px = geometry.height_px;
  const Rigid3 world_from_cam = geometry.cam_from_world.Inverse();
  for (uint32_t y = 0; y < map.height_px; ++y) {
    for (uint32_t x = 0; x < map.width_px; ++x) {
      const Eigen::Vector2d at = geometry.camera.Normalize(Eigen::Vector2d(x, y));
      double depth = Trace(shapes, world_from_cam.translation,
                           world_from_cam.rotation * Eigen::Vector3d(at.x(), at.y(), 1));
      double gauss = -6;
      for (int i = 0; i < 12; ++i) gauss += random.Unit();
      depth *= 1 + noise * gauss;
      if (random.Unit() < outliers) depth *= 0.5 + 0.5 * random.Unit();
      map.depth.push_back(static_cast<float>(depth));
      map.confidence.push_back(depth > 0 ? 255 : 0);
    }
  }
  return map;
}

// Views from all sides of a sphere, 26 of them.
inline std::vector<ViewGeometry> ViewsAround(const Eigen::Vector3d& center, double distance,
                                             uint32_t size) {
  std::vector<ViewGeometry> views;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        views.push_back(
            LookAt(center + distance * Eigen::Vector3d(x, y, z).normalized(), center, size, size));
      }
    }
  }
  return views;
}

}  // namespace veduta::synthetic
