// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a marker looks like: a dark ring, inside it the ring of the code, inside that a checkerboard
// of two by two.
//
// Marker frame: the checkerboard's corner, which is the feature point, is (0, 0); x right and y
// down as printed; the radius of the outer dark ring is 1.

#include "engine/camera/markers/marker_code.h"

namespace veduta {

inline constexpr double kMarkerQuietRadius = 1.25;  // bright paper from 1 to here, at least
inline constexpr double kMarkerCodeRadius = 0.83;   // the dark ring ends, the code begins
inline constexpr double kMarkerBoardRadius = 0.55;  // the code ends, the checkerboard begins

// Whether there is ink at this place. Sector i of the code lies between i and i + 1 times 360 / 23
// degrees, counted from the x axis towards the y axis; the checkerboard is dark where x and y have
// the same sign.
bool IsMarkerDark(MarkerId id, double x, double y);

}  // namespace veduta
