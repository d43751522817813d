// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where photos and surveyed points are on the earth: WGS 84.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

struct GeoPosition {
  double latitude_deg = 0, longitude_deg = 0;  // in [-90, 90] and [-180, 180]
  double height_m = 0;                         // above what the source of it means
  bool operator==(const GeoPosition&) const = default;
};

// What a photo says of where it was taken.
struct GpsFix {
  double latitude_deg = 0, longitude_deg = 0;
  std::optional<double> height_m;
  double accuracy_m = 0;  // horizontal; 0 where it is not told
  // Where the camera looked: clockwise from the true north, in [0, 360).
  std::optional<double> heading_deg;
  bool operator==(const GpsFix&) const = default;
};

struct GroundSighting {
  ImageId image;
  double x_px = 0, y_px = 0;  // in the photo upright, with its lens
  bool operator==(const GroundSighting&) const = default;
};

// A point that was surveyed (a ground control point), and where photos show it.
struct GroundPoint {
  std::string name;  // unique, not empty
  GeoPosition position;
  double deviation_m = 0;                 // > 0; standard deviation along each axis
  std::vector<GroundSighting> sightings;  // ascending images, each once
  bool operator==(const GroundPoint&) const = default;
};

// How much a fit was told, and how much of it agrees with the fit.
struct FitTally {
  uint32_t used = 0, agreeing = 0;
  double error_m = 0;  // root mean square over those that agree, of the distance
  bool operator==(const FitTally&) const = default;
};

}  // namespace veduta
