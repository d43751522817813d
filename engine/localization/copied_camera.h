// SPDX-License-Identifier: Apache-2.0
#pragma once
// The camera of a photo that is a copy of a stored one, resized or turned upright, as messengers
// make them: it is that one's, as much smaller or larger.

#include <optional>
#include <span>

#include "engine/localization/photo_localization.h"
#include "storage/model/image_size.h"
#include "storage/model/pair.h"

namespace veduta {

// The camera of a copy of `copy_size` (px, as it is stored) of a photo by this camera. The
// orientations are those of both, as ImageRecord has them; the copy has other sides' ratio only by
// rounding.
CameraModel CameraOfCopy(const CameraModel& camera, int orientation, ImageSize copy_size,
                         int copy_orientation);

// The camera of a photo whose matches with this stored image say that the two are one picture
// (MatchAsOnePicture): one that is stored already where there is such a one, otherwise one without
// a number. Nothing where they do not say so. `photo` has no distortion. O(cameras).
Result<std::optional<CameraRecord>> FindCopiedCamera(const LocalizationParts& parts,
                                                     const PreparedPhoto& photo, ImageId image,
                                                     std::span<const FeatureMatch> matches);

}  // namespace veduta
