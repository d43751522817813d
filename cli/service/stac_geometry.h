// SPDX-License-Identifier: Apache-2.0
#pragma once
// Parts of the earth that a search names: boxes and GeoJSON geometries (RFC 7946).

#include <functional>

#include "cli/wire/json.h"
#include "engine/engine.h"
#include "storage/base/status.h"

namespace veduta {

// Whether a position is inside or on the border. Heights are not looked at. Pure.
using EarthPart = std::function<bool(const GeoPosition&)>;

// An array of west, south, east, north in degrees, or of six numbers with heights between. West may
// be greater than east: then the box crosses the antimeridian. kInvalidArgument says what is wrong.
Result<EarthPart> BoxOf(const Json& bbox);

// A geometry of any type. Lines between positions are straight in degrees, and do not cross the
// antimeridian. A test takes as long as the geometry has positions. kInvalidArgument.
Result<EarthPart> GeometryOf(const Json& geometry);

}  // namespace veduta
