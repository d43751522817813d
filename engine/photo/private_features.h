// SPDX-License-Identifier: Apache-2.0
#pragma once
// Features that would tell of what is private in a photo, or of how that was filled.

#include <span>

#include "engine/camera/private_areas.h"
#include "storage/model/camera.h"
#include "storage/model/features.h"

namespace veduta {

// Half the diagonal of what a descriptor is made of, in the keypoint's scale: four bins across of 3
// scales each, and half a bin more on either side for those between which a sample is shared
// (engine/features/descriptor.cc).
inline constexpr double kSupportRadius = 10.7;

// Drops features whose support touches one of the areas, which are of the photo as it was taken.
// `camera` tells where a feature lies there; where it is null, the photo was not distorted. The
// others keep their order.
void DropPrivate(std::span<const PixelArea> areas, const CameraModel* camera, Features* features);

}  // namespace veduta
