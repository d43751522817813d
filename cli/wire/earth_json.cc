// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/earth_json.h"

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

Json ToJson(const GroundSighting& sighting) {
  return {{"id", sighting.image.value}, {"x", sighting.x_px}, {"y", sighting.y_px}};
}

}  // namespace

Json ToJson(const GpsFix& fix) {
  return {{"latitude", fix.latitude_deg},
          {"longitude", fix.longitude_deg},
          {"height", fix.height_m ? Json(*fix.height_m) : Json(nullptr)},
          {"accuracy_m", fix.accuracy_m > 0 ? Json(fix.accuracy_m) : Json(nullptr)}};
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
  add("position_stddev_m", earth.position_stddev_m);
  return json;
}

Json ToJson(const GroundPointAnswer& ground) {
  const bool is_seen = ground.reconstruction.valid();
  Json sightings = Json::array();
  for (const GroundSighting& sighting : ground.point.sightings)
    sightings.push_back(ToJson(sighting));
  Json json = {{"name", ground.point.name}};
  json.update(ToJson(ground.point.position));
  json["stddev_m"] = ground.point.deviation_m;
  json["sightings"] = std::move(sightings);
  json["reconstruction"] = veduta::ToJson(ground.reconstruction);
  json["error_m"] = is_seen ? Json(ground.error_m) : Json(nullptr);
  json["error_px"] = is_seen ? Json(ground.error_px) : Json(nullptr);
  return json;
}

Json ToJson(const GeoreferenceAnswer& answer) {
  return {{"points_read", answer.points_read},
          {"unknown_photos", answer.unknown_photos},
          {"reconstructions", veduta::ToJson(answer.reconstructions)},
          {"ground_points", veduta::ToJson(answer.ground_points)}};
}

Json GeoPoseJson(const EarthPose& pose) {
  const auto& [x, y, z, w] = pose.enu_from_cam_xyzw;
  return {{"position",
           {{"lat", pose.position.latitude_deg},
            {"lon", pose.position.longitude_deg},
            {"h", pose.position.height_m}}},
          {"quaternion", {{"x", x}, {"y", y}, {"z", z}, {"w", w}}}};
}

}  // namespace veduta
