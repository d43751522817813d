// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that one camera took, by what they say about themselves.

#include <string>

#include "engine/camera/exif.h"
#include "engine/camera/photo_header.h"

namespace veduta {

// A name for people, equal for photos with the same intrinsics: of one make, model, lens, focal
// length, digital zoom, size and orientation, as "Apple iPhone 12, 4.2 mm, 4032x3024". A photo that
// was cropped or resized has another size, and so another name. Empty where the photo does not tell
// model and focal length, as after it was sent by a messenger.
std::string CameraGroupOf(const ExifCamera& camera, const PhotoHeader& header);

}  // namespace veduta
