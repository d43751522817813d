// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/ray_table.h"

#include <cmath>
#include <string>

namespace veduta::street {
namespace {

// The radius r with r (1 + k1 r^2 + k2 r^4) = distorted on the branch through 0, or a negative
// number.
double InvertRadius(double distorted, double k1, double k2) {
  double r = distorted;
  for (int i = 0; i < 50; ++i) {
    const double r2 = r * r;
    const double slope = 1 + r2 * (3 * k1 + 5 * k2 * r2);
    if (slope < 0.05) return -1;
    const double step = (r * (1 + r2 * (k1 + k2 * r2)) - distorted) / slope;
    r -= step;
    if (!(r >= 0 && r < 100)) return -1;
    if (std::abs(step) <= 1e-15 * (1 + r)) break;
  }
  const double r2 = r * r;
  if (std::abs(r * (1 + r2 * (k1 + k2 * r2)) - distorted) > 1e-10) return -1;
  // The branch must rise all the way from 0: the slope, quadratic in r^2, is smallest at an end or
  // at its vertex.
  if (k2 > 0 && -3 * k1 > 0) {
    const double vertex = -3 * k1 / (10 * k2);
    if (vertex < r2 && 1 + vertex * (3 * k1 + 5 * k2 * vertex) <= 0) return -1;
  }
  return r;
}

}  // namespace

Status CheckCamera(const CameraModel& camera) {
  const auto outside = [](double x, double low, double high) { return !(x >= low && x <= high); };
  if (camera.width_px < 16 || camera.width_px > 8192 || camera.height_px < 16 ||
      camera.height_px > 8192) {
    return Status::InvalidArgument("photo size " + std::to_string(camera.width_px) + "x" +
                                   std::to_string(camera.height_px) +
                                   " is outside 16x16 to 8192x8192");
  }
  if (outside(camera.fx, 10, 1e5) || outside(camera.fy, 10, 1e5)) {
    return Status::InvalidArgument("focal length " + std::to_string(camera.fx) + "," +
                                   std::to_string(camera.fy) + " px is outside [10, 100000]");
  }
  for (const double c : {camera.cx, camera.cy, camera.u0, camera.v0}) {
    if (outside(c, -1e4, 2e4))
      return Status::InvalidArgument("centre " + std::to_string(c) + " px is out of range");
  }
  if (outside(camera.k1, -2, 2) || outside(camera.k2, -2, 2)) {
    return Status::InvalidArgument("distortion k1 " + std::to_string(camera.k1) + ", k2 " +
                                   std::to_string(camera.k2) + " is outside [-2, 2]");
  }
  return {};
}

Eigen::Vector2d ProjectPoint(const CameraModel& camera, const Eigen::Vector3d& point_in_cam) {
  const Eigen::Vector2d x(point_in_cam.x() / point_in_cam.z(), point_in_cam.y() / point_in_cam.z());
  const Eigen::Vector2d c((camera.u0 - camera.cx) / camera.fx, (camera.v0 - camera.cy) / camera.fy);
  const double r2 = (x - c).squaredNorm();
  const Eigen::Vector2d d = c + (x - c) * (1 + r2 * (camera.k1 + camera.k2 * r2));
  return {camera.fx * d.x() + camera.cx, camera.fy * d.y() + camera.cy};
}

Result<RayTable> MakeRayTable(const CameraModel& camera) {
  VEDUTA_RETURN_IF_ERROR(CheckCamera(camera));
  RayTable table;
  table.camera = camera;
  const size_t count = size_t{table.stride()} * (camera.height_px + 2);
  table.x.resize(count);
  table.y.resize(count);
  const double center_x = (camera.u0 - camera.cx) / camera.fx,
               center_y = (camera.v0 - camera.cy) / camera.fy;
  const bool straight = camera.k1 == 0 && camera.k2 == 0;
  size_t i = 0;
  for (int v = -1; v <= static_cast<int>(camera.height_px); ++v) {
    for (int u = -1; u <= static_cast<int>(camera.width_px); ++u, ++i) {
      double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
      if (!straight) {
        const double dx = x - center_x, dy = y - center_y, distorted = std::sqrt(dx * dx + dy * dy);
        const double radius = InvertRadius(distorted, camera.k1, camera.k2);
        if (radius < 0) {
          return Status::InvalidArgument("the distortion k1 " + std::to_string(camera.k1) +
                                         ", k2 " + std::to_string(camera.k2) +
                                         " folds over: no ray reaches pixel " + std::to_string(u) +
                                         "," + std::to_string(v));
        }
        const double scale = distorted > 0 ? radius / distorted : 1;
        x = center_x + dx * scale;
        y = center_y + dy * scale;
      }
      table.x[i] = static_cast<float>(x);
      table.y[i] = static_cast<float>(y);
    }
  }
  return table;
}

}  // namespace veduta::street
