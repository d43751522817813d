// SPDX-License-Identifier: Apache-2.0
#pragma once
// What goes through the door of the coordinates that surveyed points are written in.

#include <optional>
#include <string>

namespace veduta {

// What the coordinates of a file of surveyed points are, and what brings them to WGS 84.
struct GroundCoordinates {
  std::string name;       // as the first line of the file has it
  std::string operation;  // what PROJ calls it; where lines need several, the least exact of them
  // To how many metres the operation tells where on the earth a point is; distances between points
  // stay as exact as they are. 0 where the datum stays; nothing where PROJ does not know.
  std::optional<double> accuracy_m;
};

}  // namespace veduta
