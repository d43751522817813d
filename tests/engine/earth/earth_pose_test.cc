// SPDX-License-Identifier: Apache-2.0
// Goal: a camera's latitude, longitude, height, heading, pitch, roll and GeoPose are those that it
//   was made with, near the origin and far from it; its errors are those of the place.
// Method: cameras held in known ways at places known in degrees, carried into the frame of a
//   reconstruction by the inverse of a known similarity.
#include "engine/earth/earth_pose.h"

#include <gtest/gtest.h>

#include "engine/earth/local_frame.h"
#include "tests/engine/earth/level_cameras.h"

namespace veduta {
namespace {

using testing::HeldCamera;
using testing::Radians;

EarthPlace Place() {
  EarthPlace place;
  place.origin = {47.07, 15.44, 350};
  place.enu_from_world = {7.5, Eigen::Quaterniond(0.4, 0.2, -0.6, 0.5).normalized(), {120, -40, 8}};
  return place;
}

// The camera in the reconstruction that is held like that at a place on the earth.
Rigid3 CameraAt(const EarthPlace& place, const GeoPosition& position, double heading_deg,
                double pitch_deg, double roll_deg) {
  const LocalFrame origin(place.origin);
  Eigen::Matrix3d there_from_here;
  const Eigen::Vector3d enu = origin.FromGeo(position);
  origin.ToGeo(enu, &there_from_here);
  const Rigid3 held = HeldCamera(Eigen::Vector3d::Zero(), heading_deg, pitch_deg, roll_deg);
  const Eigen::Quaterniond cam_from_here = held.rotation * Eigen::Quaterniond(there_from_here);
  const Rigid3 cam_from_enu{cam_from_here, -(cam_from_here * enu)};
  return TransformCameraWorld(place.enu_from_world.Inverse(), cam_from_enu);
}

TEST(EarthPose, IsWhereAndAsTheCameraWasHeld) {
  const EarthPlace place = Place();
  for (const GeoPosition& position :
       {GeoPosition{47.0701, 15.4399, 351.6}, GeoPosition{47.5, 14.8, 900}}) {
    for (const double heading : {0.0, 44.0, 181.0, 359.5}) {
      const EarthPose pose = EarthPoseOf(place, 3, CameraAt(place, position, heading, 12, -7));
      EXPECT_NEAR(pose.position.latitude_deg, position.latitude_deg, 1e-10);
      EXPECT_NEAR(pose.position.longitude_deg, position.longitude_deg, 1e-10);
      EXPECT_NEAR(pose.position.height_m, position.height_m, 1e-5);
      EXPECT_NEAR(pose.heading_deg, heading, 1e-6);
      EXPECT_NEAR(pose.pitch_deg, 12, 1e-6);
      EXPECT_NEAR(pose.roll_deg, -7, 1e-6);
      EXPECT_EQ(pose.version, 3u);
      const auto& [x, y, z, w] = pose.enu_from_cam_xyzw;
      const Eigen::Vector3d forward = Eigen::Quaterniond(w, x, y, z) * Eigen::Vector3d::UnitZ();
      EXPECT_NEAR(forward.z(), std::sin(Radians(12)), 1e-9);
      EXPECT_GE(w, 0);
    }
  }
}

TEST(EarthPose, ErrsAsItsPlaceDoes) {
  EarthPlace place = Place();
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  covariance.diagonal() << 1e-4, 0, 0, Radians(1) * Radians(1), 4, 9, 16;
  place.covariance = PackCovariance(covariance);
  EXPECT_EQ((UnpackCovariance(place.covariance) - covariance).norm(), 0);
  place.pivot = {100, 0, 0};
  // At the pivot rotation and scale do nothing.
  const Eigen::Vector3d at_pivot = place.enu_from_world.Inverse() * place.pivot;
  EXPECT_LT(
      (PositionCovariance(place, at_pivot) - Eigen::Vector3d(4, 9, 16).asDiagonal().toDenseMatrix())
          .norm(),
      1e-9);
  // 200 m to the east of it they do.
  const Eigen::Vector3d far = place.enu_from_world.Inverse() * Eigen::Vector3d(300, 0, 0);
  const Eigen::Matrix3d there = PositionCovariance(place, far);
  EXPECT_NEAR(there(0, 0), 4 + 200 * 200 * 1e-4, 1e-9);
  EXPECT_NEAR(there(1, 1), 9 + std::pow(200 * Radians(1), 2), 1e-9);
  EXPECT_NEAR(there(2, 2), 16, 1e-9);
  const EarthPose pose = EarthPoseOf(place, 1, {Eigen::Quaterniond::Identity(), -far});
  EXPECT_NEAR(pose.horizontal_stddev_m, std::sqrt(there(0, 0) + there(1, 1)), 1e-9);
  EXPECT_NEAR(pose.vertical_stddev_m, 4, 1e-9);
  EXPECT_NEAR(pose.heading_stddev_deg, 1, 1e-9);
}

// A camera at the pivot that looks to the east, level, in a reconstruction whose unit is 7.5 m.
TEST(EarthPose, ErrsAsItsOwnPoseDoesToo) {
  EarthPlace place = Place();
  place.covariance = {};
  const Rigid3 cam = CameraAt(place, place.origin, 90, 0, 0);
  EarthPose pose = EarthPoseOf(place, 1, cam);
  EXPECT_EQ(pose.horizontal_stddev_m, 0);
  PoseUncertainty own;
  // Of turns about the camera's axes, by one, two and three degrees; of the centre by 0.1 each way.
  for (size_t i = 0; i < 3; ++i) {
    own.covariance[i][i] = std::pow(Radians(1 + double(i)), 2);
    own.covariance[3 + i][3 + i] = 0.01;
  }
  AddUncertainty(place, own, &pose);
  EXPECT_NEAR(pose.heading_stddev_deg, 2, 1e-6) << "about the axis that points down";
  const double metres = 0.1 * place.enu_from_world.scale;
  EXPECT_NEAR(pose.horizontal_stddev_m, std::sqrt(2) * metres, 1e-9);
  EXPECT_NEAR(pose.vertical_stddev_m, metres, 1e-9);
  // Tilted down, turns about its axis of sight change the heading as well.
  EarthPose tilted = EarthPoseOf(place, 1, CameraAt(place, place.origin, 90, -60, 0));
  AddUncertainty(place, own, &tilted);
  EXPECT_GT(tilted.heading_stddev_deg, 2);
}

TEST(EarthAnswer, TellsWhatIsKnown) {
  Georeference georeference;
  EXPECT_FALSE(EarthAnswerOf(georeference).is_known);
  georeference.version = 4;
  georeference.place = Place();
  georeference.place->fixes = {12, 11, 3.5};
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  covariance.diagonal() << 0.01, Radians(3) * Radians(3), Radians(4) * Radians(4),
      Radians(2) * Radians(2), 9, 16, 4;
  georeference.place->covariance = PackCovariance(covariance);
  const EarthAnswer answer = EarthAnswerOf(georeference);
  EXPECT_TRUE(answer.is_known);
  EXPECT_EQ(answer.version, 4u);
  EXPECT_EQ(answer.scale, 7.5);
  EXPECT_EQ(answer.fixes.agreeing, 11u);
  EXPECT_NEAR(answer.scale_stddev_share, 0.1, 1e-12);
  EXPECT_NEAR(answer.tilt_stddev_deg, 5, 1e-9);
  EXPECT_NEAR(answer.heading_stddev_deg, 2, 1e-9);
  EXPECT_NEAR(answer.horizontal_stddev_m, 5, 1e-12);
  EXPECT_NEAR(answer.vertical_stddev_m, 2, 1e-12);
}

}  // namespace
}  // namespace veduta
