// SPDX-License-Identifier: Apache-2.0
// Goal: what is told of the earth has the keys that docs/json.md lists, in one order, with null for
//   what is not known.
// Method: answers of the door with known values, as text.
#include "cli/wire/earth_json.h"

#include <gtest/gtest.h>

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
  image.gps = GpsFix{47.5, 15.25, 351.5, 4.5};
  EXPECT_EQ(JsonLine(ToJson(image)["on_earth"]), kEarthPose);
  EXPECT_EQ(JsonLine(PoseJson(image)["on_earth"]), kEarthPose);
  EXPECT_EQ(JsonLine(ToJson(image)["gps"]),
            R"({"latitude":47.5,"longitude":15.25,"height":351.5,"accuracy_m":4.5})");
  EXPECT_EQ(JsonLine(ToJson(GpsFix{47.5, 15.25, {}, 0})),
            R"({"latitude":47.5,"longitude":15.25,"height":null,"accuracy_m":null})");
  LocalizedPhoto photo;
  photo.on_earth = SomeEarthPose();
  EXPECT_EQ(JsonLine(ToJson(photo)["on_earth"]), kEarthPose);
}

TEST(EarthJson, Georeference) {
  GeoreferenceAnswer answer;
  answer.points_read = 1;
  answer.unknown_photos = {"x.jpg"};
  EarthAnswer earth;
  earth.reconstruction = ReconstructionId(2);
  earth.images = 12;
  answer.reconstructions = {earth};
  EXPECT_EQ(JsonLine(ToJson(answer)),
            R"({"points_read":1,"unknown_photos":["x.jpg"],"reconstructions":[{)"
            R"("reconstruction":2,"images":12,"version":0,"known":false,"origin":null,)"
            R"("scale":null,"rotation_wxyz":null,"translation":null,"gps":null,)"
            R"("ground_points":null,"scale_stddev_share":null,"heading_stddev_deg":null,)"
            R"("tilt_stddev_deg":null,"position_stddev_m":null}],"ground_points":[]})");
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
  earth.position_stddev_m = 4;
  EXPECT_EQ(JsonLine(ToJson(earth)),
            R"({"reconstruction":2,"images":12,"version":4,"known":true,)"
            R"("origin":{"latitude":47.5,"longitude":15.25,"height":350.0},"scale":7.5,)"
            R"("rotation_wxyz":[1.0,0.0,0.0,0.0],"translation":[1.0,2.0,3.0],)"
            R"("gps":{"used":12,"agreeing":11,"error_m":3.5},)"
            R"("ground_points":{"used":2,"agreeing":2,"error_m":0.25},)"
            R"("scale_stddev_share":0.125,"heading_stddev_deg":2.0,"tilt_stddev_deg":3.0,)"
            R"("position_stddev_m":4.0})");
  GroundPointAnswer ground;
  ground.point = {"corner", {47.5, 15.25, 350}, 0.5, {{ImageId(3), 1.5, 2.5}}};
  const std::string surveyed =
      R"({"name":"corner","latitude":47.5,"longitude":15.25,"height":350.0,"stddev_m":0.5,)"
      R"("sightings":[{"id":3,"x":1.5,"y":2.5}],"reconstruction":)";
  EXPECT_EQ(JsonLine(ToJson(ground)), surveyed + R"(null,"error_m":null,"error_px":null})");
  ground.reconstruction = ReconstructionId(2);
  ground.error_m = {0.5, -0.25, 1};
  ground.error_px = 0.75;
  EXPECT_EQ(JsonLine(ToJson(ground)), surveyed + R"(2,"error_m":[0.5,-0.25,1.0],"error_px":0.75})");
}

}  // namespace
}  // namespace veduta
