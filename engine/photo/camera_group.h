// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that one camera took, by what they say about themselves.

#include <functional>
#include <optional>
#include <string>

#include "engine/camera/exif.h"
#include "engine/camera/photo_header.h"
#include "storage/database.h"

namespace veduta {

// By so many times a focal length that a photo tells may differ from what it is; where it differs
// by more, the photo was cropped since, or zoomed. Chosen by hand.
inline constexpr double kToldTimesMax = 1.2;

// A name for people, equal for photos with the same intrinsics: of one make, model, lens, focal
// length, digital zoom, size and orientation, as "Apple iPhone 12, 4.2 mm, 4032x3024". Empty where
// the photo does not tell model and focal length, as after it was sent by a messenger, and where it
// tells that it was cropped or resized: it was taken with another size than it has.
std::string CameraGroupOf(const ExifCamera& camera, const PhotoHeader& header);

// The focal length over the photo's longer side, as the 35 mm equivalent has it, good to some
// percent: by the diagonal, which is how most makers count it. Nothing where it is not told, where
// no photo has it (under 0.3 or over 20), or where the photo is a part of what was taken.
std::optional<double> FocalShareOf(const ExifCamera& camera, const ImageSize& size);

// Whether two photos tell the same focal length, or one of them tells none (0): up to a fifth. Some
// phones write a digital zoom into the 35 mm equivalent alone.
bool IsToldAlike(double a_share, double b_share);

// The name, or where it is taken "NAME (2)", or the next number that is free.
std::string NumberedName(const std::string& name,
                         const std::function<bool(const std::string& name)>& is_taken);
// Whether it is the name, or the name with a number.
bool IsNumberedName(const std::string& numbered, const std::string& name);

// The name of a camera that photos of one size have told together which tell nothing of themselves:
// "photos of 1536x1024".
std::string SilentGroupOf(const ImageSize& size);

// The stored camera of a group, the first one whose first photo told the same focal length as this
// one (IsToldAlike). Nothing where there is none. O(cameras).
Result<std::optional<CameraRecord>> FindGroupCamera(const Snapshot& snapshot,
                                                    const std::string& group,
                                                    std::optional<double> focal_share);

}  // namespace veduta
