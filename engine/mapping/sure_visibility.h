// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a view cannot but see. Of what must be seen (visibility.h) a part may be hidden: a sparse
// map knows no walls where it has no points. And a part may be there for some photos only: signs
// light up at night, a mill's sails turn, buses stop before a house.

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

// FindVisible in those parts of the picture alone whose points most of `others` find that must see
// them. O(others * points * track length).
VisibleStructure FindUsuallySeen(const CityMap& map, const MapImage& view,
                                 std::span<const SeenDepth> seen, std::span<const PointId> points,
                                 std::span<const ImageId> others, const VisibilityOptions& options);

}  // namespace veduta
