// SPDX-License-Identifier: Apache-2.0
#pragma once
// The images near which a photo was taken, where somebody knows that.

#include <string>
#include <vector>

#include "engine/door/moderation.h"
#include "storage/database.h"
#include "storage/model/geo.h"

namespace veduta {

// A stored photo, as FindImage finds it, and those that share most matches with it, the most first;
// a dozen at most. Errors are those of FindImage. O(its verified pairs).
Result<std::vector<ImageId>> ImagesNear(const Snapshot& snapshot, const std::string& photo,
                                        const Sight& sight = {});

// The images that stand nearest to the place, whatever its height; a dozen at most. Empty where no
// reconstruction has a place on the earth. O(poses).
Result<std::vector<ImageId>> ImagesNear(const Snapshot& snapshot, const GeoPosition& place);

}  // namespace veduta
