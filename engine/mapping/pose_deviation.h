// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether what a view sees says where it stands.

#include "engine/mapping/city_map.h"

namespace veduta {

// How far the centre of a placed view may be off for errors of 1 mrad in what it sees (standard
// deviation), over how far away the points are (the median of their depths). Whoever sees a house
// front far down the street and nothing else may stand anywhere on an arc around it, for all its
// points. The points are as uncertain as the other loaded images leave them; these are held
// (CovarianceOfPose). Infinite where the points do not determine the pose. O(observations of the
// view's points). Reads the map only.
double DeviationShare(const CityMap& map, ImageId view);

}  // namespace veduta
