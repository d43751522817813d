// SPDX-License-Identifier: Apache-2.0
// Goal: what is told of the earth has the keys that docs/json.md lists, in one order, with null for
//   what is not known.
// Method: answers of the door with known values, as text.
#include "cli/wire/earth_json.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "cli/wire/added_json.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

EarthPose SomeEarthPose() {
  return {{47.5, 15.25, 350.5}, 90.5, 1.5, -2.5, {0.5, -0.5, 0.5, 0.5}, 2, 4.5, 0.75, 3};
}

constexpr const char* kEarthPose =
    R"({"latitude":47.5,"longitude":15.25,"height":350.5,"heading_deg":90.5,"pitch_deg":1.5,)"
    R"("roll_deg":-2.5,"quaternion_xyzw":[0.5,-0.5,0.5,0.5],"horizontal_stddev_m":2.0,)"
    R"("vertical_stddev_m":4.5,"heading_stddev_deg":0.75,"version":3})";

TEST(EarthJson, Pose) {
  EXPECT_EQ(JsonLine(ToJson(SomeEarthPose())), kEarthPose);
  EXPECT_EQ(JsonLine(GeoPoseJson(SomeEarthPose())),
            R"({"position":{"lat":47.5,"lon":15.25,"h":350.5},)"
            R"("quaternion":{"x":0.5,"y":-0.5,"z":0.5,"w":0.5}})");
  ImageAnswer image;
  image.on_earth = SomeEarthPose();
  image.gps = GpsFix{47.5, 15.25, 351.5, 4.5, 90.5};
  EXPECT_EQ(JsonLine(ToJson(image)["on_earth"]), kEarthPose);
  EXPECT_EQ(JsonLine(PoseJson(image)["on_earth"]), kEarthPose);
  EXPECT_EQ(JsonLine(ToJson(image)["gps"]),
            R"({"latitude":47.5,"longitude":15.25,"height":351.5,"accuracy_m":4.5,)"
            R"("heading_deg":90.5})");
  EXPECT_EQ(JsonLine(ToJson(GpsFix{47.5, 15.25, {}, 0, {}})),
            R"({"latitude":47.5,"longitude":15.25,"height":null,"accuracy_m":null,)"
            R"("heading_deg":null})");
  LocalizedPhoto photo;
  photo.on_earth = SomeEarthPose();
  EXPECT_EQ(JsonLine(ToJson(photo)["on_earth"]), kEarthPose);
}

TEST(EarthJson, BothGeoPosesAreTheSameRotation) {
  std::vector<Eigen::Quaterniond> rotations = {Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5),
                                               Eigen::Quaterniond::Identity()};
  const double r = std::sqrt(0.5);
  for (const double sign : {1., -1.}) {  // the x axis is upright
    rotations.push_back(Eigen::Quaterniond(r, 0, sign * r, 0));
    rotations.push_back(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ()) * rotations.back());
  }
  for (int i = 1; i < 20; ++i)
    rotations.push_back(
        Eigen::Quaterniond(i % 5 - 2.5, i % 3 - 1, i % 7 - 3, 0.1 * i).normalized());
  for (const Eigen::Quaterniond& rotation : rotations) {
    EarthPose pose = SomeEarthPose();
    pose.enu_from_cam_xyzw = {rotation.x(), rotation.y(), rotation.z(), rotation.w()};
    const Json json = GeoPoseYprJson(pose);
    EXPECT_EQ(json["position"], GeoPoseJson(pose)["position"]);
    EXPECT_EQ(json.size(), 2u);
    const auto angle = [&](const char* name) {
      return json["angles"][name].get<double>() * std::numbers::pi / 180;
    };
    const Eigen::Quaterniond again(Eigen::AngleAxisd(angle("yaw"), Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(angle("pitch"), Eigen::Vector3d::UnitY()) *
                                   Eigen::AngleAxisd(angle("roll"), Eigen::Vector3d::UnitX()));
    EXPECT_LT(again.angularDistance(rotation), 1e-6) << json;
  }
}

TEST(EarthJson, WhenAPhotoWasTaken) {
  EXPECT_EQ(JsonLine(ToJson(TakenTime{1'700'000'000, 3600})),
            R"({"clock":"2023-11-14T22:13:20","offset_s":3600})");
  EXPECT_EQ(JsonLine(ToJson(TakenTime{0, std::nullopt})),
            R"({"clock":"1970-01-01T00:00:00","offset_s":null})");
}

TEST(EarthJson, Georeference) {
  GeoreferenceAnswer answer;
  answer.points_read = 1;
  answer.coordinates = GroundCoordinates{"EPSG:27700", "by steps", {}};
  answer.unknown_photos = {"x.jpg"};
  EarthAnswer earth;
  earth.reconstruction = ReconstructionId(2);
  earth.images = 12;
  answer.reconstructions = {earth};
  EXPECT_EQ(JsonLine(ToJson(answer)),
            R"({"points_read":1,"coordinates":{"name":"EPSG:27700","operation":"by steps",)"
            R"("accuracy_m":null},"unknown_photos":["x.jpg"],"reconstructions":[{)"
            R"("reconstruction":2,"images":12,"version":0,"known":false,"origin":null,)"
            R"("scale":null,"rotation_wxyz":null,"translation":null,"gps":null,)"
            R"("ground_points":null,"scale_stddev_share":null,"heading_stddev_deg":null,)"
            R"("tilt_stddev_deg":null,"horizontal_stddev_m":null,"vertical_stddev_m":null}],)"
            R"("ground_points":[]})");
  earth.is_known = true;
  earth.version = 4;
  earth.origin = {47.5, 15.25, 350};
  earth.scale = 7.5;
  earth.translation = {1, 2, 3};
  earth.fixes = {12, 11, 3.5};
  earth.ground_points = {2, 2, 0.25};
  earth.scale_stddev_share = 0.125;
  earth.heading_stddev_deg = 2;
  earth.tilt_stddev_deg = 3;
  earth.horizontal_stddev_m = 4;
  earth.vertical_stddev_m = 8;
  EXPECT_EQ(JsonLine(ToJson(earth)),
            R"({"reconstruction":2,"images":12,"version":4,"known":true,)"
            R"("origin":{"latitude":47.5,"longitude":15.25,"height":350.0},"scale":7.5,)"
            R"("rotation_wxyz":[1.0,0.0,0.0,0.0],"translation":[1.0,2.0,3.0],)"
            R"("gps":{"used":12,"agreeing":11,"error_m":3.5},)"
            R"("ground_points":{"used":2,"agreeing":2,"error_m":0.25},)"
            R"("scale_stddev_share":0.125,"heading_stddev_deg":2.0,"tilt_stddev_deg":3.0,)"
            R"("horizontal_stddev_m":4.0,"vertical_stddev_m":8.0})");
  GroundPointAnswer ground;
  ground.point = {"corner", {47.5, 15.25, 350}, 0.5, {{ImageId(3), 1.5, 2.5}}};
  const std::string surveyed =
      R"({"name":"corner","latitude":47.5,"longitude":15.25,"height":350.0,"stddev_m":0.5,)"
      R"("sightings":[{"id":3,"x":1.5,"y":2.5}],"reconstruction":)";
  EXPECT_EQ(JsonLine(ToJson(ground)), surveyed + R"(null,"error_m":null,"error_px":null})");
  ground.error_px = 0.5;
  EXPECT_EQ(JsonLine(ToJson(ground)), surveyed + R"(null,"error_m":null,"error_px":0.5})")
      << "seen, by a reconstruction without a place";
  ground.reconstruction = ReconstructionId(2);
  ground.error_m = {0.5, -0.25, 1};
  ground.error_px = 0.75;
  EXPECT_EQ(JsonLine(ToJson(ground)), surveyed + R"(2,"error_m":[0.5,-0.25,1.0],"error_px":0.75})");
}

}  // namespace
}  // namespace veduta
