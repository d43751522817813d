// SPDX-License-Identifier: Apache-2.0
#include "cli/service/stac_geometry.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace veduta {
namespace {

// Collections of geometries in each other. Chosen by hand.
constexpr int kDepthMax = 4;

struct Place {
  double longitude, latitude;
};
using Line = std::vector<Place>;
using Rings = std::vector<Line>;

struct Shapes {
  std::vector<Line> lines;  // one of a single place is a point
  std::vector<Rings> polygons;
};

Status Wrong(const std::string& what) {
  return Status::InvalidArgument("'intersects': " + what);
}

Status ReadPlace(const Json& position, Place* place) {
  const bool is_position =
      position.is_array() && position.size() >= 2 && position.size() <= 3 &&
      std::ranges::all_of(position, [](const Json& n) { return n.is_number(); });
  if (!is_position) return Wrong("a position is no array of two or three numbers");
  *place = {position[0].get<double>(), position[1].get<double>()};
  const bool is_on_earth = std::abs(place->longitude) <= 180 && std::abs(place->latitude) <= 90;
  return is_on_earth ? Status::Ok() : Wrong("a position is no longitude and latitude in degrees");
}

Status ReadLine(const Json& positions, size_t count_min, Line* line) {
  if (!positions.is_array() || positions.size() < count_min)
    return Wrong("a list of positions is no array, or has less than " + std::to_string(count_min));
  for (const Json& position : positions)
    VEDUTA_RETURN_IF_ERROR(ReadPlace(position, &line->emplace_back()));
  return Status::Ok();
}

Status ReadPolygon(const Json& rings, Rings* polygon) {
  if (!rings.is_array() || rings.empty()) return Wrong("a polygon has no rings");
  for (const Json& ring : rings) {
    Line& line = polygon->emplace_back();
    VEDUTA_RETURN_IF_ERROR(ReadLine(ring, 4, &line));
    const bool is_closed = line.front().longitude == line.back().longitude &&
                           line.front().latitude == line.back().latitude;
    if (!is_closed) return Wrong("a ring does not end where it begins");
  }
  return Status::Ok();
}

Status ReadGeometry(const Json& geometry, int depth, Shapes* shapes);

// Calls read on each of an array.
template <typename Read>
Status ReadEach(const Json& list, const Read& read) {
  if (!list.is_array()) return Wrong("the coordinates, or the geometries, are no array");
  for (const Json& one : list) VEDUTA_RETURN_IF_ERROR(read(one));
  return Status::Ok();
}

Status ReadCoordinates(const std::string& type, const Json& coordinates, Shapes* shapes) {
  const auto read_point = [&](const Json& position) {
    return ReadPlace(position, &shapes->lines.emplace_back().emplace_back());
  };
  const auto read_line = [&](const Json& positions) {
    return ReadLine(positions, 2, &shapes->lines.emplace_back());
  };
  const auto read_polygon = [&](const Json& rings) {
    return ReadPolygon(rings, &shapes->polygons.emplace_back());
  };
  if (type == "Point") return read_point(coordinates);
  if (type == "MultiPoint") return ReadEach(coordinates, read_point);
  if (type == "LineString") return read_line(coordinates);
  if (type == "MultiLineString") return ReadEach(coordinates, read_line);
  if (type == "Polygon") return read_polygon(coordinates);
  if (type == "MultiPolygon") return ReadEach(coordinates, read_polygon);
  return Wrong("there is no type of geometry '" + type + "'");
}

Status ReadGeometry(const Json& geometry, int depth, Shapes* shapes) {
  if (!geometry.is_object()) return Wrong("a geometry is no object");
  const Json type = geometry.value("type", Json());
  if (!type.is_string()) return Wrong("a geometry has no type");
  if (type != "GeometryCollection")
    return ReadCoordinates(type.get<std::string>(), geometry.value("coordinates", Json()), shapes);
  if (depth >= kDepthMax)
    return Wrong("more than " + std::to_string(kDepthMax) + " collections are in each other");
  return ReadEach(geometry.value("geometries", Json()),
                  [&](const Json& one) { return ReadGeometry(one, depth + 1, shapes); });
}

bool IsBetween(double a, double x, double b) {
  return std::min(a, b) <= x && x <= std::max(a, b);
}

bool IsOnSegment(const Place& a, const Place& b, const Place& p) {
  const double cross = (b.longitude - a.longitude) * (p.latitude - a.latitude) -
                       (b.latitude - a.latitude) * (p.longitude - a.longitude);
  return cross == 0 && IsBetween(a.longitude, p.longitude, b.longitude) &&
         IsBetween(a.latitude, p.latitude, b.latitude);
}

bool IsOnLine(const Line& line, const Place& p) {
  for (size_t i = 0; i < line.size(); ++i) {
    if (IsOnSegment(line[i > 0 ? i - 1 : 0], line[i], p)) return true;
  }
  return false;
}

// By the edges that are crossed on the way to the east: an odd number of them from inside, holes
// included.
bool IsInPolygon(const Rings& rings, const Place& p) {
  bool is_in = false;
  for (const Line& ring : rings) {
    if (IsOnLine(ring, p)) return true;
    for (size_t i = 1; i < ring.size(); ++i) {
      const Place &a = ring[i - 1], &b = ring[i];
      if ((a.latitude > p.latitude) == (b.latitude > p.latitude)) continue;
      const double t = (p.latitude - a.latitude) / (b.latitude - a.latitude);
      if (p.longitude < a.longitude + t * (b.longitude - a.longitude)) is_in = !is_in;
    }
  }
  return is_in;
}

}  // namespace

Result<EarthPart> BoxOf(const Json& bbox) {
  const bool has_numbers =
      bbox.is_array() && (bbox.size() == 4 || bbox.size() == 6) &&
      std::ranges::all_of(bbox, [](const Json& number) { return number.is_number(); });
  if (!has_numbers)
    return Status::InvalidArgument(
        "'bbox' must be four numbers, west, south, east, north, or six with heights between");
  const size_t half = bbox.size() / 2;
  const double west = bbox[0].get<double>(), south = bbox[1].get<double>();
  const double east = bbox[half].get<double>(), north = bbox[half + 1].get<double>();
  const bool is_on_earth = std::abs(west) <= 180 && std::abs(east) <= 180 &&
                           std::abs(south) <= 90 && std::abs(north) <= 90;
  if (!is_on_earth || south > north)
    return Status::InvalidArgument(
        "'bbox' must be longitudes and latitudes in degrees, and south not above north");
  return EarthPart([=](const GeoPosition& p) {
    const double x = p.longitude_deg;
    const bool is_beside = west <= east ? west <= x && x <= east : west <= x || x <= east;
    return is_beside && south <= p.latitude_deg && p.latitude_deg <= north;
  });
}

Result<EarthPart> GeometryOf(const Json& geometry) {
  const auto shapes = std::make_shared<Shapes>();
  VEDUTA_RETURN_IF_ERROR(ReadGeometry(geometry, 0, shapes.get()));
  return EarthPart([shapes](const GeoPosition& position) {
    const Place p{position.longitude_deg, position.latitude_deg};
    return std::ranges::any_of(shapes->lines, [&](const Line& l) { return IsOnLine(l, p); }) ||
           std::ranges::any_of(shapes->polygons, [&](const Rings& r) { return IsInPolygon(r, p); });
  });
}

}  // namespace veduta
