// SPDX-License-Identifier: Apache-2.0
#pragma once
// What nothing can hide from a view. A sparse map knows no walls where it has no points: of what
// must be seen (visibility.h), a part may be hidden by a house that hardly a point is known of.

#include <span>

#include "engine/mapping/city_map.h"
#include "engine/mapping/visibility.h"

namespace veduta {

// FindVisible of those of the expected points alone that are surely visible: where the view itself
// sees as far, or where images see the point from either side of the view. O(points * track
// length^2).
VisibleStructure FindSurelyVisible(const CityMap& map, const MapImage& view,
                                   std::span<const SeenDepth> seen, std::span<const PointId> points,
                                   const VisibilityOptions& options);

}  // namespace veduta
