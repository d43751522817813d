// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/sweep_geometry.h"

#include <algorithm>
#include <cmath>

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr int kGridSide = 12, kDepthSamples = 5;
constexpr double kPercentile = 0.9;

Eigen::Matrix3d CameraMatrix(const Pinhole& camera) {
  Eigen::Matrix3d k;
  k << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return k;
}

Eigen::Matrix3d InverseCameraMatrix(const Pinhole& camera) {
  Eigen::Matrix3d k;
  k << 1 / camera.fx, 0, -camera.cx / camera.fx, 0, 1 / camera.fy, -camera.cy / camera.fy, 0, 0, 1;
  return k;
}

// Length of d(pixel)/dw; negative where the sensor view does not see the point.
double Speed(const SweepGeometry& geometry, const ViewGeometry& sensor, double x_px, double y_px,
             double w) {
  const Eigen::Vector3d ray = geometry.Ray(x_px, y_px, w);
  if (ray.z() <= 0) return -1;
  const Eigen::Vector2d at = ray.head<2>() / ray.z();
  if (at.x() < 0 || at.y() < 0 || at.x() > sensor.width_px - 1 || at.y() > sensor.height_px - 1)
    return -1;
  return ((geometry.translation.head<2>() - at * geometry.translation.z()) / ray.z()).norm();
}

}  // namespace

SweepGeometry::SweepGeometry(const ViewGeometry& key, const ViewGeometry& sensor) {
  const Rigid3 sensor_from_key = sensor.cam_from_world * key.cam_from_world.Inverse();
  const Eigen::Matrix3d k = CameraMatrix(sensor.camera);
  rotation = k * sensor_from_key.rotation.toRotationMatrix() * InverseCameraMatrix(key.camera);
  translation = k * sensor_from_key.translation;
}

double PixelsPerInverseDepth(const ViewGeometry& key, std::span<const ViewGeometry> sensors,
                             double first, double last) {
  std::vector<SweepGeometry> geometries;
  for (const ViewGeometry& sensor : sensors) geometries.emplace_back(key, sensor);
  std::vector<double> speeds;
  for (int i = 0; i < kGridSide * kGridSide * kDepthSamples; ++i) {
    const double x = (i % kGridSide + 0.5) * key.width_px / kGridSide;
    const double y = (i / kGridSide % kGridSide + 0.5) * key.height_px / kGridSide;
    const int sample = i / (kGridSide * kGridSide);
    const double w = first + (last - first) * sample / (kDepthSamples - 1);
    double fastest = -1;
    for (size_t s = 0; s < sensors.size(); ++s)
      fastest = std::max(fastest, Speed(geometries[s], sensors[s], x, y, w));
    if (fastest >= 0) speeds.push_back(fastest);
  }
  if (speeds.empty()) return 0;
  std::sort(speeds.begin(), speeds.end());
  return speeds[static_cast<size_t>(kPercentile * static_cast<double>(speeds.size() - 1))];
}

PlaneSpacing SpacePlanes(double first, double last, double pixels_per_inverse_depth, double step_px,
                         uint32_t count_max) {
  const double wanted = std::ceil((last - first) * pixels_per_inverse_depth / step_px) + 1;
  // At least three, so that there is something between the ends.
  const uint32_t count =
      static_cast<uint32_t>(std::clamp(wanted, 3.0, static_cast<double>(count_max)));
  return {first, (last - first) / (count - 1), count};
}

}  // namespace veduta
