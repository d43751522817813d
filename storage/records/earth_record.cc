// SPDX-License-Identifier: Apache-2.0
#include "storage/records/earth_record.h"

#include <cmath>

#include "storage/records/message.h"
#include "storage/records/record_parts.h"

namespace veduta {
namespace {

struct SightingRow {
  uint32_t image = 0, zero = 0;
  double x_px = 0, y_px = 0;
};

// Above and below which nothing is that a photo shows.
constexpr double kHeightMax = 100'000;

Status CheckPlace(double latitude_deg, double longitude_deg, double height_m) {
  if (!(std::abs(latitude_deg) <= 90)) return Broken("latitude", latitude_deg, "in [-90, 90]");
  if (!(std::abs(longitude_deg) <= 180))
    return Broken("longitude", longitude_deg, "in [-180, 180]");
  if (!(std::abs(height_m) <= kHeightMax)) return Broken("height", height_m, "within 100 km");
  return Status::Ok();
}

Status CheckPosition(const GeoPosition& position) {
  return CheckPlace(position.latitude_deg, position.longitude_deg, position.height_m);
}

Status CheckTally(const FitTally& tally) {
  if (tally.agreeing > tally.used)
    return Broken("agreeing", tally.agreeing, "at most " + std::to_string(tally.used));
  if (!(std::isfinite(tally.error_m) && tally.error_m >= 0))
    return Broken("error_m", tally.error_m, "finite and not below 0");
  return Status::Ok();
}

Status CheckEarthPlace(const EarthPlace& place) {
  VEDUTA_RETURN_IF_ERROR(CheckPosition(place.origin));
  const Sim3& s = place.enu_from_world;
  if (!(std::isfinite(s.scale) && s.scale > 0))
    return Broken("scale of enu_from_world", s.scale, "finite and above 0");
  VEDUTA_RETURN_IF_ERROR(CheckTransform(s.rotation, s.translation));
  if (!place.pivot.allFinite()) return Broken("pivot", place.pivot.sum(), "finite");
  for (const double number : place.covariance)
    VEDUTA_RETURN_IF_ERROR(CheckFinite({{"covariance", number}}));
  VEDUTA_RETURN_IF_ERROR(CheckTally(place.fixes));
  return CheckTally(place.ground_points);
}

void Fill(schema::GeoPosition::Builder to, const GeoPosition& position) {
  to.setLatitudeDeg(position.latitude_deg);
  to.setLongitudeDeg(position.longitude_deg);
  to.setHeightM(position.height_m);
}

GeoPosition Read(schema::GeoPosition::Reader from) {
  return {from.getLatitudeDeg(), from.getLongitudeDeg(), from.getHeightM()};
}

void Fill(schema::FitTally::Builder to, const FitTally& tally) {
  to.setUsed(tally.used);
  to.setAgreeing(tally.agreeing);
  to.setErrorM(tally.error_m);
}

FitTally Read(schema::FitTally::Reader from) {
  return {from.getUsed(), from.getAgreeing(), from.getErrorM()};
}

void Fill(schema::EarthPlace::Builder to, const EarthPlace& place) {
  Fill(to.initOrigin(), place.origin);
  to.setScale(place.enu_from_world.scale);
  veduta::Fill(to.initEnuFromWorld(), place.enu_from_world.rotation,
               place.enu_from_world.translation);
  to.setPivot(AsData(place.pivot.data(), 3));
  to.setCovariance(AsData(place.covariance.data(), place.covariance.size()));
  Fill(to.initFixes(), place.fixes);
  Fill(to.initGroundPoints(), place.ground_points);
}

Status Read(schema::EarthPlace::Reader from, EarthPlace* place) {
  place->origin = Read(from.getOrigin());
  place->enu_from_world.scale = from.getScale();
  veduta::Read(from.getEnuFromWorld(), &place->enu_from_world.rotation,
               &place->enu_from_world.translation);
  std::vector<double> numbers;
  if (!CopyRows(from.getPivot(), &numbers) || numbers.size() != 3) return BadRows("pivot");
  place->pivot = {numbers[0], numbers[1], numbers[2]};
  if (!CopyRows(from.getCovariance(), &numbers) || numbers.size() != place->covariance.size())
    return BadRows("covariance");
  std::copy(numbers.begin(), numbers.end(), place->covariance.begin());
  place->fixes = Read(from.getFixes());
  place->ground_points = Read(from.getGroundPoints());
  return Status::Ok();
}

}  // namespace

Status Check(const GpsFix& fix) {
  VEDUTA_RETURN_IF_ERROR(CheckPlace(fix.latitude_deg, fix.longitude_deg, fix.height_m.value_or(0)));
  if (!(std::isfinite(fix.accuracy_m) && fix.accuracy_m >= 0))
    return Broken("accuracy_m", fix.accuracy_m, "finite and not below 0");
  const double heading_deg = fix.heading_deg.value_or(0);
  if (!(heading_deg >= 0 && heading_deg < 360))
    return Broken("heading_deg", heading_deg, "in [0, 360)");
  return Status::Ok();
}

void Fill(schema::Gps::Builder to, const GpsFix& fix) {
  to.setLatitudeDeg(fix.latitude_deg);
  to.setLongitudeDeg(fix.longitude_deg);
  to.setHasHeight(fix.height_m.has_value());
  to.setHeightM(fix.height_m.value_or(0));
  to.setAccuracyM(fix.accuracy_m);
  to.setHasHeading(fix.heading_deg.has_value());
  to.setHeadingDeg(fix.heading_deg.value_or(0));
}

GpsFix Read(schema::Gps::Reader from) {
  GpsFix fix;
  fix.latitude_deg = from.getLatitudeDeg();
  fix.longitude_deg = from.getLongitudeDeg();
  if (from.getHasHeight()) fix.height_m = from.getHeightM();
  fix.accuracy_m = from.getAccuracyM();
  if (from.getHasHeading()) fix.heading_deg = from.getHeadingDeg();
  return fix;
}

Status Check(const Georeference& georeference) {
  if (!georeference.place) return Status::Ok();
  if (georeference.version == 0) return Broken("version of a place", 0, "1 or more");
  return CheckEarthPlace(*georeference.place);
}

void Fill(schema::Georeference::Builder to, const Georeference& georeference) {
  to.setVersion(georeference.version);
  to.setImagesAtLook(georeference.images_at_look);
  to.setImagesAtAdjustment(georeference.images_at_adjustment);
  if (georeference.place) Fill(to.initPlace(), *georeference.place);
}

Status Read(schema::Georeference::Reader from, Georeference* georeference) {
  georeference->version = from.getVersion();
  georeference->images_at_look = from.getImagesAtLook();
  georeference->images_at_adjustment = from.getImagesAtAdjustment();
  georeference->place.reset();
  if (!from.hasPlace()) return Status::Ok();
  return Read(from.getPlace(), &georeference->place.emplace());
}

std::string GroundPointKey(std::string_view name) {
  return std::string(kGroundPointPrefix).append(name);
}

Status ParseGroundPointKey(std::string_view key, GroundPoint* point) {
  if (!key.starts_with(kGroundPointPrefix)) return Status::Corruption("no such key is known");
  point->name = key.substr(kGroundPointPrefix.size());
  if (point->name.empty()) return Status::Corruption("a ground point without a name");
  return Status::Ok();
}

Status Check(const GroundPoint& point) {
  if (point.name.empty()) return Broken("name of a ground point", "empty", "given");
  VEDUTA_RETURN_IF_ERROR(CheckPosition(point.position));
  if (!(std::isfinite(point.deviation_m) && point.deviation_m > 0))
    return Broken("deviation_m", point.deviation_m, "finite and above 0");
  for (const GroundSighting& sighting : point.sightings) {
    VEDUTA_RETURN_IF_ERROR(CheckId("image of a sighting", sighting.image));
    VEDUTA_RETURN_IF_ERROR(CheckFinite({{"x_px", sighting.x_px}, {"y_px", sighting.y_px}}));
  }
  const auto less = [](const GroundSighting& a, const GroundSighting& b) {
    return a.image < b.image;
  };
  if (StrictlyAscending(std::span<const GroundSighting>(point.sightings), less))
    return Status::Ok();
  return Broken("list of sightings", "out of order", "of ascending images, each once");
}

Result<std::string> Encode(const GroundPoint& point) {
  VEDUTA_RETURN_IF_ERROR(Check(point));
  std::vector<SightingRow> rows;
  for (const GroundSighting& sighting : point.sightings)
    rows.push_back({sighting.image.value, 0, sighting.x_px, sighting.y_px});
  return WriteMessage<schema::GroundPoint>(rows.size() * sizeof(SightingRow), [&](auto to) {
    Fill(to.initPosition(), point.position);
    to.setDeviationM(point.deviation_m);
    to.setSightings(AsData(rows));
  });
}

Status Decode(std::string_view value, GroundPoint* point) {
  return ReadMessage<schema::GroundPoint>(value, [&](schema::GroundPoint::Reader from) {
    point->position = Read(from.getPosition());
    point->deviation_m = from.getDeviationM();
    std::vector<SightingRow> rows;
    if (!CopyRows(from.getSightings(), &rows)) return BadRows("sightings");
    point->sightings.clear();
    for (const SightingRow& row : rows)
      point->sightings.push_back({ImageId(row.image), row.x_px, row.y_px});
    return Damaged(Check(*point));
  });
}

}  // namespace veduta
