// SPDX-License-Identifier: Apache-2.0
#pragma once
// Surveyed points as a text file, in the format of ODM (gcp_list.txt).

#include <string>
#include <string_view>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/geo.h"

namespace veduta {

// Where one photo shows one point: a line of the file.
struct GroundLine {
  std::string point;  // the name that the line ends with, or else the coordinates as they are
                      // written
  GeoPosition position;
  double x_px = 0, y_px = 0;
  std::string photo;
  int number = 0;  // of the line
};

// The first line names the coordinates: "EPSG:25833" or what else PROJ knows by its name, a
// definition that begins with "+proj=", or "WGS84 UTM 33N". Each other line has east, north and
// height, then x and y in the photo as it stands upright (px; the centre of the top left one is 0,
// 0; it has its lens), the photo's name
// and, if the point has one, its name, with white space or tabulators between; with tabulators
// names may have spaces. Empty lines and those that begin with # are nothing. Coordinates are
// brought to WGS 84 by PROJ with what it has of grids at hand; it asks no server, and where it
// lacks the one that is needed the first line is refused. A height stays as it is, where the first
// line does not say what it is above. Longitudes come before latitudes where the coordinates are
// degrees. kInvalidArgument names the line.
Result<std::vector<GroundLine>> ParseGroundPoints(std::string_view text);

}  // namespace veduta
