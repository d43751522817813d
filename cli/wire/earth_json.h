// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of where the city is on the earth. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const GpsFix& fix);
Json ToJson(const TakenTime& taken);
Json ToJson(const EarthPose& pose);
Json ToJson(const EarthAnswer& earth);
Json ToJson(const GroundPointAnswer& ground);
Json ToJson(const GeoreferenceAnswer& answer);
// A GeoPose of the Basic-Quaternion kind (OGC 21-056r11): the camera's axes (x to the right, y
// down, z forward) in the frame of east, north and up.
Json GeoPoseJson(const EarthPose& pose);
// The same of the Basic-YPR kind: degrees about up, then about the y axis as it is turned by that,
// then about the x axis.
Json GeoPoseYprJson(const EarthPose& pose);

}  // namespace veduta
