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
