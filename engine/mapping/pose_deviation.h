// SPDX-License-Identifier: Apache-2.0
#pragma once
// How exactly the points that a view sees tell where it stands.

#include <span>

#include "engine/mapping/city_map.h"

namespace veduta {

// How far the centre of a placed view may be off for errors of 1 mrad in what it sees (standard
// deviation), over how far away the points are (the median of their depths). A view of nothing but
// a house front far down the street may stand anywhere on an arc around that front, for all its
// points. The points are as uncertain as the other loaded images leave them; these are held
// (CovarianceOfPose). Infinite where the points do not determine the pose. O(observations of the
// view's points). Reads the map only.
double DeviationShare(const CityMap& map, ImageId view);

// How far the centre of a view at this pose may be off for errors of 1 mrad (standard deviation),
// over the median depth of the points, if it sees exactly these points and their positions have no
// error. Infinite where they do not determine the pose. O(points).
double DeviationShare(const Rigid3& cam_from_world, std::span<const Eigen::Vector3d> points);

// How far the centre of a placed view may be off (standard deviation) among the `neighbors_max`
// images that share most points with it, over the median depth of its points: by the errors that
// are there, and where all of these images are as uncertain as what they see leaves them
// (CovarianceInNetwork). Infinite where that does not determine them. Reads the map only. Costs as
// CovarianceInNetwork.
double DeviationShareInNetwork(const CityMap& map, ImageId view, uint32_t neighbors_max);

}  // namespace veduta
