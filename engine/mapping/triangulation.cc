// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/triangulation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace veduta {
namespace {

constexpr double kDegFromRad = 180.0 / std::numbers::pi;

}  // namespace

double RayAngleDeg(const Eigen::Vector3d& center_a, const Eigen::Vector3d& center_b,
                   const Eigen::Vector3d& point) {
  const Eigen::Vector3d a = point - center_a, b = point - center_b;
  return std::atan2(a.cross(b).norm(), a.dot(b)) * kDegFromRad;
}

double TriangulationAngleDeg(std::span<const Sighting> views, const Eigen::Vector3d& point) {
  double largest = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = i + 1; j < views.size(); ++j) {
      largest = std::max(largest, RayAngleDeg(views[i].cam_from_world.Center(),
                                              views[j].cam_from_world.Center(), point));
    }
  }
  return largest;
}

bool HasAngle(std::span<const Sighting> views, const Eigen::Vector3d& point, double angle_deg_min) {
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(views.size());
  for (size_t i = 0; i < views.size(); ++i) {
    centers.push_back(views[i].cam_from_world.Center());
    for (size_t j = 0; j < i; ++j) {
      if (RayAngleDeg(centers[j], centers[i], point) >= angle_deg_min) return true;
    }
  }
  return !(angle_deg_min > 0);
}

double ReprojectionErrorPx(const Sighting& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d x_cam = view.cam_from_world * point;
  if (!(x_cam.z() > 0)) return std::numeric_limits<double>::infinity();
  return (view.camera.Project(x_cam) - view.x_px).norm();
}

std::optional<Eigen::Vector3d> Triangulate(std::span<const Sighting> views) {
  if (views.size() < 2) return std::nullopt;
  // The point nearest to all rays: sum over views of (I - r r^T)(X - C) = 0.
  Eigen::Matrix3d system = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Sighting& view : views) {
    const Eigen::Vector3d ray =
        (view.cam_from_world.rotation.conjugate() * view.camera.Normalize(view.x_px).homogeneous())
            .normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    system += across;
    right += across * view.cam_from_world.Center();
  }
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(system);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-10)) return std::nullopt;
  Eigen::Vector3d point = ldlt.solve(right);
  for (int iteration = 0; iteration < 5; ++iteration) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const Sighting& view : views) {
      const Eigen::Vector3d x_cam = view.cam_from_world * point;
      if (!(x_cam.z() > 0)) return std::nullopt;
      Eigen::Matrix<double, 2, 3> projection;
      projection << view.camera.fx / x_cam.z(), 0,
          -view.camera.fx * x_cam.x() / (x_cam.z() * x_cam.z()), 0, view.camera.fy / x_cam.z(),
          -view.camera.fy * x_cam.y() / (x_cam.z() * x_cam.z());
      const Eigen::Matrix<double, 2, 3> jacobian =
          projection * view.cam_from_world.rotation.toRotationMatrix();
      normal += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * (view.camera.Project(x_cam) - view.x_px);
    }
    const Eigen::Vector3d step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) return std::nullopt;
    point += step;
    if (step.squaredNorm() < 1e-20 * point.squaredNorm()) break;
  }
  for (const Sighting& view : views) {
    if (!((view.cam_from_world * point).z() > 0)) return std::nullopt;
  }
  return point.allFinite() ? std::optional(point) : std::nullopt;
}

}  // namespace veduta
