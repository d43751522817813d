// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a photo was taken whose camera is not known (R24).

#include "engine/localization/photo_localization.h"

namespace veduta {

// Matches the photo as it was taken with what looks like it, and estimates its focal length and
// distortion from the points that these images see (engine/mapping/unknown_camera.h), beginning
// with the focal length that the photo tells of itself, if any. With that camera it is localised
// like any other photo (LocalizePhoto), while the camera is refined by all that it then sees; anew,
// twice at most, where that has changed the camera. A photo whose bytes are stored has the camera
// that it was stored with. One that does not say which camera took it is tried with those that
// photos of its size have told together which tell nothing either, and has one of them where it
// wants no other focal length. Where `known` is given, it receives such a camera, or where the
// photo is a copy of a stored one, the copy's camera (FindCopiedCamera); a copy is not localised
// then. Errors, determinism and threads are those of LocalizePhoto.
Result<LocalizedPhoto> LocalizeUnknown(const LocalizationParts& parts,
                                       const PhotoPreparer& preparer, const PhotoSource& source,
                                       std::optional<CameraRecord>* known = nullptr);

}  // namespace veduta
