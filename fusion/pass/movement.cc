// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/movement.h"

#include <algorithm>
#include <limits>

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr size_t kPointCountMax = 500;

double Percentile90(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 9 / 10);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

std::vector<Eigen::Vector3d> PointsInCamera(const Scene& scene, const SceneImage& image) {
  std::vector<Eigen::Vector3d> points;
  const size_t step = image.observations.size() / kPointCountMax + 1;
  for (size_t i = 0; i < image.observations.size(); i += step) {
    points.push_back(image.cam_from_world * scene.points[image.observations[i].point].position);
  }
  return points;
}

double MovedPx(std::span<const Eigen::Vector3d> points, const Pinhole& sensor,
               const Rigid3& sensor_from_key_then, const Rigid3& sensor_from_key_now) {
  std::vector<double> moved;
  for (const Eigen::Vector3d& x : points) {
    const Eigen::Vector3d then = sensor_from_key_then * x, now = sensor_from_key_now * x;
    const bool in_front = then.z() > 0 && now.z() > 0;
    moved.push_back(in_front ? (sensor.Project(then) - sensor.Project(now)).norm()
                             : std::numeric_limits<double>::infinity());
  }
  return Percentile90(std::move(moved));
}

double MovedInWorld(std::span<const Eigen::Vector3d> points, const Rigid3& cam_from_world_then,
                    const Rigid3& cam_from_world_now) {
  const Rigid3 then = cam_from_world_then.Inverse(), now = cam_from_world_now.Inverse();
  std::vector<double> moved;
  for (const Eigen::Vector3d& x : points) moved.push_back((then * x - now * x).norm());
  return Percentile90(std::move(moved));
}

}  // namespace veduta
