// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which images look at the same places.

#include <cstddef>
#include <span>
#include <vector>

#include "engine/mapping/city_map.h"

namespace veduta {

// Images that share points with `image`, those with most first, and of two with as many the one of
// the lower id first; at most `count_max`. Only `image` and the blocks of its points need to be
// loaded. O(sum of the lengths of its tracks). Reads the map only.
std::vector<ImageId> CovisibleImages(const CityMap& map, ImageId image, size_t count_max);
// CovisibleImages of a view that need not be in the map.
std::vector<ImageId> CovisibleImages(const CityMap& map, const MapImage& view, size_t count_max);
// CovisibleImages, but only those in `among` (ascending); where that is empty, among all images.
std::vector<ImageId> CovisibleImages(const CityMap& map, ImageId image, size_t count_max,
                                     std::span<const ImageId> among);

}  // namespace veduta
