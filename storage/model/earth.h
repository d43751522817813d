// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a reconstruction is on the earth.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "storage/base/transform.h"
#include "storage/model/geo.h"

namespace veduta {

// Where a reconstruction is on the earth: metres to the east, the north and above of an origin.
struct EarthPlace {
  GeoPosition origin;
  Sim3 enu_from_world;
  // Covariance of (log scale, omega, d): the truth is that similarity scaled and turned by
  // exp([omega]x) about `pivot`, and moved by d; all in the frame of the origin, rad and m. Row by
  // row, the lower triangle.
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  std::array<double, 28> covariance{};
  FitTally fixes, ground_points;
};

// What a reconstruction knows of its place, and when it was last looked for.
struct Georeference {
  uint32_t version = 0;  // grows with each place that is published; 0 while there never was one
  uint32_t images_at_look = 0, images_at_adjustment = 0;  // of the reconstruction, at that time
  std::optional<EarthPlace> place;  // nothing where what is told is too little
};

}  // namespace veduta
