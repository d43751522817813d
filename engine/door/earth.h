// SPDX-License-Identifier: Apache-2.0
#pragma once
// What goes through the door of where the city is on the earth (WGS 84).

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/model/geo.h"

namespace veduta {

// Where a camera was on the earth, and where it looked. The height is above what the heights mean
// that it rests on: phones mostly tell heights above the sea.
struct EarthPose {
  GeoPosition position;
  // Of the optical axis: clockwise from true north, and above the horizon; and of the camera about
  // it, clockwise as the photographer sees it. Degrees.
  double heading_deg = 0, pitch_deg = 0, roll_deg = 0;
  // Unit quaternion (x, y, z, w) that turns vectors of the camera (x to the right, y down, z
  // forward) into east, north and up at that position, as GeoPose has it.
  std::array<double, 4> enu_from_cam_xyzw = {0, 0, 0, 1};
  // Standard deviations: of both axes on the plan together, of the height, of the heading. They are
  // those of the reconstruction's place on the earth; within it the pose has its own
  // (PoseUncertainty).
  double horizontal_stddev_m = 0, vertical_stddev_m = 0, heading_stddev_deg = 0;
  uint32_t version = 0;  // of the reconstruction's place
};

// Where a reconstruction is on the earth.
struct EarthAnswer {
  ReconstructionId reconstruction;
  uint32_t images = 0;    // in it
  uint32_t version = 0;   // of the place that was published last; 0: there never was one
  bool is_known = false;  // false where too little tells the place; then all that follows is unset
  GeoPosition origin;
  // x_enu = scale R(rotation_wxyz) x_world + translation: metres to the east, the north and above
  // the origin.
  double scale = 1;
  std::array<double, 4> rotation_wxyz = {1, 0, 0, 0};
  std::array<double, 3> translation = {0, 0, 0};
  FitTally fixes, ground_points;  // that it was fitted to
  // Standard deviations: of the scale over itself, of the rotation about up, of the other two
  // together, and of the middle of what is told, on the plan (both axes together) and in height.
  double scale_stddev_share = 0, heading_stddev_deg = 0, tilt_stddev_deg = 0;
  double horizontal_stddev_m = 0, vertical_stddev_m = 0;
};

// A surveyed point, beside where the photos show it.
struct GroundPointAnswer {
  GroundPoint point;
  ReconstructionId reconstruction;  // valid where two photos of one with a place show it
  // From where it was surveyed to where the photos see it, metres to the east, the north and above.
  std::array<double, 3> error_m = {0, 0, 0};
  // Root mean square over its photos, of the point that they see; above 0 also where they see it
  // and the place of their reconstruction is not known. 0: it is not seen.
  double error_px = 0;
};

// What the coordinates of a file of surveyed points are, and what brings them to WGS 84.
struct GroundCoordinates {
  std::string name;       // as the first line of the file has it
  std::string operation;  // what PROJ calls it; where lines need several, the least exact of them
  // To how many metres the operation tells where on the earth a point is; distances between points
  // stay as exact as they are. 0 where the datum stays; nothing where PROJ does not know.
  std::optional<double> accuracy_m;
};

struct GeoreferenceRequest {
  // A text file of surveyed points, as ODM reads it (gcp_list.txt); empty: none. Points of a name
  // that is known are replaced.
  std::string ground_points_path;
  std::optional<std::string> ground_points = {};  // what such a file holds, in place of a path
  // > 0; standard deviation of the surveyed points along each axis, metres.
  double ground_deviation_m = 0.05;
  bool forget_ground_points = false;  // those that are stored, first
  std::string actor = "anonymous";    // who asks, for the journal

  Status Check() const;  // the first violated bound, named with its value
};

struct GeoreferenceAnswer {
  uint32_t points_read = 0;                      // of the file
  std::optional<GroundCoordinates> coordinates;  // of the file; nothing where none was read
  std::vector<std::string> unknown_photos;       // which the file names, and the city does not hold
  std::vector<EarthAnswer> reconstructions;      // living ones, largest first, then ascending ids
  std::vector<GroundPointAnswer> ground_points;  // all that are stored; ascending names
};

}  // namespace veduta
