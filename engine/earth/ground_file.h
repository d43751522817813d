// SPDX-License-Identifier: Apache-2.0
#pragma once
// Surveyed points as a text file, in the format of ODM (gcp_list.txt).

#include <string>
#include <string_view>
#include <vector>

#include "engine/door/earth.h"
#include "storage/base/status.h"
#include "storage/model/geo.h"

namespace veduta {

// Where one photo shows one point: a line of the file.
struct GroundLine {
  std::string point;  // the name that the line has, or else the coordinates as they are written
  GeoPosition position;
  double x_px = 0, y_px = 0;
  std::string photo;
  int number = 0;  // of the line
};

struct GroundFile {
  std::vector<GroundLine> lines;
  GroundCoordinates coordinates;
};

// The first line names the coordinates: "EPSG:25833" or what else PROJ knows by its name, a
// definition that begins with "+proj=", or "WGS84 UTM 33N". Each other line has east, north and
// height, then x and y in the photo as it stands upright (px; the centre of the top left one is 0,
// 0; it has its lens), the photo's name and, if the point has one, its name; what follows is
// ignored. Between them is white space, or tabulators: then names may have spaces. Empty lines and
// those that begin with # are nothing. Longitudes come before latitudes where the coordinates are
// degrees.
//
// Coordinates are brought to WGS 84 by PROJ with what it has of grids at hand; it asks no server.
// Where it lacks the best grid between two datums it takes the next best operation, whose accuracy
// is told. The first line is refused where no operation is left that is more than a guess: where it
// names a geoid whose grid is missing, or no datum. Where it does not say what heights are above
// they stay what they are, in the unit of east and north (degrees: in metres).
//
// kInvalidArgument names the line.
Result<GroundFile> ParseGroundPoints(std::string_view text);

}  // namespace veduta
