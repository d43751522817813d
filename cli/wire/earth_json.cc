// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/earth_json.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cli/wire/iso_time.h"

namespace veduta {
namespace {

Json ToJson(const GeoPosition& position) {
  return {{"latitude", position.latitude_deg},
          {"longitude", position.longitude_deg},
          {"height", position.height_m}};
}

Json ToJson(const FitTally& tally) {
  return {{"used", tally.used}, {"agreeing", tally.agreeing}, {"error_m", tally.error_m}};
}

Json PositionOfGeoPose(const EarthPose& pose) {
  return {{"lat", pose.position.latitude_deg},
          {"lon", pose.position.longitude_deg},
          {"h", pose.position.height_m}};
}

Json ToJson(const GroundCoordinates& coordinates) {
  const auto& accuracy_m = coordinates.accuracy_m;
  return {{"name", coordinates.name},
          {"operation", coordinates.operation},
          {"accuracy_m", accuracy_m ? Json(*accuracy_m) : Json(nullptr)}};
}

Json ToJson(const GroundSighting& sighting) {
  return {{"id", sighting.image.value}, {"x", sighting.x_px}, {"y", sighting.y_px}};
}

}  // namespace

Json ToJson(const GpsFix& fix) {
  return {{"latitude", fix.latitude_deg},
          {"longitude", fix.longitude_deg},
          {"height", fix.height_m ? Json(*fix.height_m) : Json(nullptr)},
          {"accuracy_m", fix.accuracy_m > 0 ? Json(fix.accuracy_m) : Json(nullptr)},
          {"heading_deg", fix.heading_deg ? Json(*fix.heading_deg) : Json(nullptr)}};
}

Json ToJson(const TakenTime& taken) {
  std::string clock = IsoTime(taken.local_unix_s);
  clock.pop_back();  // the Z: it is that of the camera's zone
  return {{"clock", clock}, {"offset_s", taken.offset_s ? Json(*taken.offset_s) : Json(nullptr)}};
}

Json ToJson(const EarthPose& pose) {
  Json json = ToJson(pose.position);
  json["heading_deg"] = pose.heading_deg;
  json["pitch_deg"] = pose.pitch_deg;
  json["roll_deg"] = pose.roll_deg;
  json["quaternion_xyzw"] = pose.enu_from_cam_xyzw;
  json["horizontal_stddev_m"] = pose.horizontal_stddev_m;
  json["vertical_stddev_m"] = pose.vertical_stddev_m;
  json["heading_stddev_deg"] = pose.heading_stddev_deg;
  json["version"] = pose.version;
  return json;
}

Json ToJson(const EarthAnswer& earth) {
  Json json = {{"reconstruction", earth.reconstruction.value},
               {"images", earth.images},
               {"version", earth.version},
               {"known", earth.is_known}};
  const auto add = [&](const char* key, Json value) {
    json[key] = earth.is_known ? std::move(value) : Json(nullptr);
  };
  add("origin", ToJson(earth.origin));
  add("scale", earth.scale);
  add("rotation_wxyz", earth.rotation_wxyz);
  add("translation", earth.translation);
  add("gps", ToJson(earth.fixes));
  add("ground_points", ToJson(earth.ground_points));
  add("scale_stddev_share", earth.scale_stddev_share);
  add("heading_stddev_deg", earth.heading_stddev_deg);
  add("tilt_stddev_deg", earth.tilt_stddev_deg);
  add("horizontal_stddev_m", earth.horizontal_stddev_m);
  add("vertical_stddev_m", earth.vertical_stddev_m);
  return json;
}

Json ToJson(const GroundPointAnswer& ground) {
  const bool has_place = ground.reconstruction.valid(), is_seen = ground.error_px > 0;
  Json sightings = Json::array();
  for (const GroundSighting& sighting : ground.point.sightings)
    sightings.push_back(ToJson(sighting));
  Json json = {{"name", ground.point.name}};
  json.update(ToJson(ground.point.position));
  json["stddev_m"] = ground.point.deviation_m;
  json["sightings"] = std::move(sightings);
  json["reconstruction"] = veduta::ToJson(ground.reconstruction);
  json["error_m"] = has_place ? Json(ground.error_m) : Json(nullptr);
  json["error_px"] = is_seen ? Json(ground.error_px) : Json(nullptr);
  return json;
}

Json ToJson(const GeoreferenceAnswer& answer) {
  return {{"points_read", answer.points_read},
          {"coordinates", answer.coordinates ? ToJson(*answer.coordinates) : Json(nullptr)},
          {"unknown_photos", answer.unknown_photos},
          {"reconstructions", veduta::ToJson(answer.reconstructions)},
          {"ground_points", veduta::ToJson(answer.ground_points)}};
}

Json GeoPoseJson(const EarthPose& pose) {
  const auto& [x, y, z, w] = pose.enu_from_cam_xyzw;
  return {{"position", PositionOfGeoPose(pose)},
          {"quaternion", {{"x", x}, {"y", y}, {"z", z}, {"w", w}}}};
}

Json GeoPoseYprJson(const EarthPose& pose) {
  const auto& [x, y, z, w] = pose.enu_from_cam_xyzw;
  constexpr double kDegrees = 180 / std::numbers::pi;
  const double sine = std::clamp(2 * (w * y - z * x), -1., 1.);
  // Where the x axis is upright, yaw and roll are one turn: all of it is yaw.
  const bool is_upright = std::abs(sine) > 1 - 1e-12;
  const double yaw = is_upright ? -2 * std::copysign(1., sine) * std::atan2(x, w)
                                : std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  const double roll = is_upright ? 0 : std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  return {{"position", PositionOfGeoPose(pose)},
          {"angles",
           {{"yaw", kDegrees * yaw},
            {"pitch", kDegrees * std::asin(sine)},
            {"roll", kDegrees * roll}}}};
}

}  // namespace veduta
