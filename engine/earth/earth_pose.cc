// SPDX-License-Identifier: Apache-2.0
#include "engine/earth/earth_pose.h"

#include <cmath>
#include <numbers>

#include "engine/earth/local_frame.h"

namespace veduta {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

}  // namespace

std::array<double, 28> PackCovariance(const Eigen::Matrix<double, 7, 7>& covariance) {
  std::array<double, 28> rows;
  size_t at = 0;
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column <= row; ++column) rows[at++] = covariance(row, column);
  }
  return rows;
}

Eigen::Matrix<double, 7, 7> UnpackCovariance(const std::array<double, 28>& rows) {
  Eigen::Matrix<double, 7, 7> covariance;
  size_t at = 0;
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column <= row; ++column)
      covariance(row, column) = covariance(column, row) = rows[at++];
  }
  return covariance;
}

Eigen::Matrix3d PositionCovariance(const EarthPlace& place, const Eigen::Vector3d& world) {
  const Eigen::Vector3d x = place.enu_from_world * world - place.pivot;
  Eigen::Matrix<double, 3, 7> jacobian;
  jacobian.col(0) = x;
  jacobian.middleCols<3>(1) << 0, x.z(), -x.y(), -x.z(), 0, x.x(), x.y(), -x.x(), 0;
  jacobian.rightCols<3>() = Eigen::Matrix3d::Identity();
  return jacobian * UnpackCovariance(place.covariance) * jacobian.transpose();
}

EarthPose EarthPoseOf(const EarthPlace& place, uint32_t version, const Rigid3& cam_from_world) {
  const Eigen::Vector3d center = cam_from_world.Center();
  EarthPose pose;
  Eigen::Matrix3d there_from_here;
  pose.position = LocalFrame(place.origin).ToGeo(place.enu_from_world * center, &there_from_here);
  const Eigen::Matrix3d enu_from_cam =
      there_from_here *
      (place.enu_from_world.rotation * cam_from_world.rotation.conjugate()).toRotationMatrix();
  const Eigen::Vector3d right = enu_from_cam.col(0), down = enu_from_cam.col(1),
                        forward = enu_from_cam.col(2);
  pose.heading_deg = std::fmod(kDegrees * std::atan2(forward.x(), forward.y()) + 360, 360);
  pose.pitch_deg = kDegrees * std::atan2(forward.z(), std::hypot(forward.x(), forward.y()));
  pose.roll_deg = kDegrees * std::atan2(-right.z(), -down.z());
  const Eigen::Quaterniond q(enu_from_cam);
  const double sign = q.w() < 0 ? -1 : 1;
  pose.enu_from_cam_xyzw = {sign * q.x(), sign * q.y(), sign * q.z(), sign * q.w()};
  const Eigen::Matrix3d covariance = PositionCovariance(place, center);
  pose.horizontal_stddev_m = std::sqrt(covariance(0, 0) + covariance(1, 1));
  pose.vertical_stddev_m = std::sqrt(covariance(2, 2));
  pose.heading_stddev_deg = kDegrees * std::sqrt(UnpackCovariance(place.covariance)(3, 3));
  pose.version = version;
  return pose;
}

void AddUncertainty(const EarthPlace& place, const PoseUncertainty& uncertainty, EarthPose* pose) {
  Eigen::Matrix3d turn, center;  // covariances: in the camera's frame, in the world
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 3; ++column) {
      turn(row, column) = uncertainty.covariance[row][column];
      center(row, column) = uncertainty.covariance[3 + row][3 + column];
    }
  }
  const double scale = place.enu_from_world.scale;
  const Eigen::Matrix3d rotation = place.enu_from_world.rotation.toRotationMatrix();
  const Eigen::Matrix3d there = scale * scale * rotation * center * rotation.transpose();
  pose->horizontal_stddev_m =
      std::hypot(pose->horizontal_stddev_m, std::sqrt(there(0, 0) + there(1, 1)));
  pose->vertical_stddev_m = std::hypot(pose->vertical_stddev_m, std::sqrt(there(2, 2)));
  const auto& [x, y, z, w] = pose->enu_from_cam_xyzw;
  const Eigen::Matrix3d enu_from_cam = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
  const Eigen::Vector3d forward = enu_from_cam.col(2);
  const double level = std::hypot(forward.x(), forward.y());
  if (!(level > 0)) return;  // straight up or down there is no heading
  // How the heading changes with a turn about each axis of the camera.
  const Eigen::Vector3d right(forward.y() / level, -forward.x() / level, 0);
  const Eigen::Vector3d change = enu_from_cam.transpose() * forward.cross(right) / level;
  pose->heading_stddev_deg =
      std::hypot(pose->heading_stddev_deg, kDegrees * std::sqrt(change.dot(turn * change)));
}

EarthAnswer EarthAnswerOf(const Georeference& georeference) {
  EarthAnswer answer;
  answer.version = georeference.version;
  answer.is_known = georeference.place.has_value();
  if (!answer.is_known) return answer;
  const EarthPlace& place = *georeference.place;
  answer.origin = place.origin;
  answer.scale = place.enu_from_world.scale;
  const Eigen::Quaterniond& q = place.enu_from_world.rotation;
  answer.rotation_wxyz = {q.w(), q.x(), q.y(), q.z()};
  const Eigen::Vector3d& t = place.enu_from_world.translation;
  answer.translation = {t.x(), t.y(), t.z()};
  answer.fixes = place.fixes;
  answer.ground_points = place.ground_points;
  const Eigen::Matrix<double, 7, 7> c = UnpackCovariance(place.covariance);
  answer.scale_stddev_share = std::sqrt(c(0, 0));
  answer.tilt_stddev_deg = kDegrees * std::sqrt(c(1, 1) + c(2, 2));
  answer.heading_stddev_deg = kDegrees * std::sqrt(c(3, 3));
  answer.horizontal_stddev_m = std::sqrt(c(4, 4) + c(5, 5));
  answer.vertical_stddev_m = std::sqrt(c(6, 6));
  return answer;
}

}  // namespace veduta
